"""Train a residual tracking policy with Brax PPO: `mjx-hand train config=pinch ppo.num_envs=512 seed=3`.

Writes to the experiment's `out` folder: `best.npz` and `last.npz` (policies), `state/` (all that resuming takes),
`curve.csv` (evaluations), `config.yaml`, and TensorBoard logs. A training that was stopped, even killed, resumes from
its last state when the same command is run again, and ends as it would have ended.
"""

import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np
from tensorboardX import SummaryWriter

from envs.demonstrations.dataset import make_missing_sets
from envs.evaluation.evaluate import evaluate_in
from envs.evaluation.roll_out import make_roll_out
from envs.parallel import ParallelEnv
from envs.physics.engine import available_engine
from envs.tracking import TrackingEnv
from mjx_hand.files.npz_archive import replacing
from mjx_hand.progress import counter
from mjx_hand.pytree import pytree
from train.experiment.setup import training_env
from train.learning.cadence import rollouts_per_demonstration, updates_between
from train.learning.checkpoint import Checkpoint, is_saved, save_checkpoint
from train.learning.curve import CURVE, Point, points_of
from train.learning.interruption import interruptions
from train.learning.learner import Learner, LearnerState, Networks
from train.learning.policy import deterministic_policy
from train.learning.run_folder import BEST, LAST, RunFolder, run_folder
from train.learning.sweep import sweepable_command
from train.learning.unstable import UnstableLog
from train.settings.config import Config
from train.settings.device import described
from train.settings.peers import watching_others
from train.settings.processes import agreed, first_alone_speaks, gathered, is_first, join
from train.settings.saved import policy_settings

_LOG_SECONDS = 2.0  # between two lines of training metrics
Watch = Callable[[Sequence["Point"], float], bool]


def train(config: Config, env: TrackingEnv | None = None, watch: Watch | None = None) -> list[Point]:
    """Train, or go on, and return the evaluations, the first before any learning.

    Args:
        config: the experiment.
        env: its training part, where the caller has made it already.
        watch: told after each update of the evaluations so far, and of the seconds that those made here took together;
            where it says True the training ends there, its state saved.

    Raises:
        InputError: an `out` folder that cannot be written, holds another training or has one under way, or whatever
            is wrong with the configuration.
        SystemExit: it was interrupted (status 128 and the signal's number); its state is saved.
    """
    with run_folder(config) as folder:
        return _train(config, env, folder, watch)


def _train(config: Config, env: TrackingEnv | None, folder: RunFolder, watch: Watch | None) -> list[Point]:
    if env is None:
        available_engine(config.engine)  # before the minutes that sets take
        make_missing_sets(config.data, config.demonstrations)
        env = training_env(config)
    learner = Learner(ParallelEnv(env, guard=config.debug.nan_guard), config.ppo)
    run = _Run(config, env, learner, folder)
    run.write_results()
    if run.finished:
        print(f"{config.name!r} is trained already ({folder.path}); train it anew with fresh=true")
        return run.points
    print(
        f"training {config.name!r} on {env.num_demonstrations} demonstrations, engine {env.engine.name}, "
        f"learner on {described()}, {config.ppo.num_envs} worlds; results in {folder.path}",
        flush=True,
    )
    if seconds := run.seconds:
        print(f"going on from {run.steps:,} steps", flush=True)
    with interruptions() as asked:
        stopped = run.until_finished(asked, watch)
    if stopped:
        print(f"stopped at {run.steps:,} steps and saved; the same command goes on from there", flush=True)
        raise SystemExit(128 + stopped)
    took = time.monotonic() - run.start - seconds
    print(f"evaluations took {run.evaluating:.0f} of {took:.0f} s ({run.evaluating / took:.0%})")
    if count := int(run.state.unstable):
        print(f"{count} simulations diverged and were started anew; debug.nan_guard=true keeps their states")
    return run.points


@pytree
class _Saved:
    """What a state holds: all that the learner carries, and the networks of the best and of the last evaluation.

    Before the first evaluation those are the untrained ones.
    """

    learner: LearnerState
    best: Networks
    last: Networks


class _Run:
    """A training on its way, new or gone on with: its state, and what it says and writes."""

    def __init__(self, config: Config, env: TrackingEnv, learner: Learner, folder: RunFolder):
        self.config, self.env, self.learner, self.folder = config, env, learner, folder
        networks = learner.template.params
        saved = folder.load(_Saved(learner=learner.template, best=networks, last=networks))
        self.points: list[Point] = []
        self.seconds = 0.0
        if saved is None:
            self.state = learner.initial(config.seed)
            self.best = self.last = gathered(self.state.params)
        else:
            state, notes = saved
            self.state, self.best, self.last = learner.placed(state.learner), state.best, state.last
            self.points, self.seconds = points_of(notes), float(notes["seconds"])
        self.updates = int(self.state.updates)
        self.settings = policy_settings(config)
        self.budget = config.ppo.budget
        self.repeats = rollouts_per_demonstration(env)
        self.between = updates_between(config.checks, config.ppo, env, self.repeats)
        self.start = time.monotonic() - self.seconds
        self.evaluating = 0.0  # seconds
        policy = deterministic_policy(config.ppo, env.observation_size, env.action_size)
        self.unstable = UnstableLog(folder.path / "unstable", env, config.seed) if config.debug.nan_guard else None
        self.roll_out = make_roll_out(env, policy, repeats=self.repeats)

    @property
    def steps(self) -> int:
        return self.updates * self.learner.steps_per_update

    @property
    def finished(self) -> bool:
        if not self.points:
            return False
        last = self.points[-1]
        return last.success >= self.config.checks.stop_at or (self.updates >= self.budget and last.steps == self.steps)

    def until_finished(self, asked: Callable[[], int], watch: Watch | None) -> int:
        """Update, evaluate and save until all is done, or watched enough; the signal's number if one came before."""
        with (
            SummaryWriter(str(self.folder.path / "tensorboard"), write_to_disk=is_first()) as writer,
            counter(self.budget * self.learner.steps_per_update, "training (steps)", self.steps) as advance,
        ):
            logged = time.monotonic()
            untrained = None
            if not self.points:
                untrained = self.last  # an update gives up what it is given
                self._save()
            while not self.finished:
                stopped = agreed(asked())
                if stopped:
                    self._save()
                    return stopped
                # To its end: Warp's calls of two programs at a time, as of an evaluation that does not need this
                # update's result, take the stream from each other ("unknown stream").
                self.state, metrics = jax.block_until_ready(self.learner.update(self.state, self.updates / self.budget))
                self.updates += 1
                if untrained is not None:
                    self._say_memory()
                if time.monotonic() - logged > _LOG_SECONDS:
                    logged = time.monotonic()
                    self._log(writer, metrics)
                self._look_for_unstable()
                advance(self.learner.steps_per_update)
                if untrained is not None:  # after the first update, which says soonest whether a training runs at all
                    self._check(writer, untrained, 0)
                    untrained = None
                due = self.updates % self.between == 0 or self.updates >= self.budget
                if due and not self.finished:
                    self._check(writer, gathered(self.state.params), self.steps)
                if due or self.finished:
                    self._save()
                if watch is not None and watch(self.points, self.evaluating):
                    self._save()
                    break
        return 0

    def _log(self, writer: SummaryWriter, metrics: Any) -> None:
        for name, value in jax.device_get(metrics).items():
            if np.isfinite(value):  # no episode may have ended in this update
                writer.add_scalar(name, float(value), self.steps)

    def _look_for_unstable(self) -> None:
        if self.unstable is not None:
            caught = gathered(self.state.worlds.info["caught"])
            for path in self.unstable.write(self.steps, caught) if is_first() else ():
                print(f"  a simulation diverged: {path}", flush=True)

    def _check(self, writer: SummaryWriter, params: Networks, steps: int) -> None:
        """All training demonstrations from frame 0; keeps the best policy, because curves are not monotone."""
        began = time.monotonic()
        scores = evaluate_in(self.env, self.roll_out(params.policy)).rows()
        point = Point(
            steps=steps,
            seconds=time.monotonic() - self.start,
            success=scores["manip_trans_object"],
            tracking_error_cm=scores["tracking_error_cm"],
            rotation_error_deg=scores["object_rotation_error_deg"],
        )
        self.evaluating += time.monotonic() - began
        self.points.append(point)
        self.last = params
        if _best(self.points) is point:
            self.best = params
        for name, score in scores.items():
            writer.add_scalar(f"evaluation/{name}", score, steps)
        self.write_results()
        print(
            f"  {point.steps:>9,} steps, {point.seconds:4.0f} s: success {100 * point.success:5.1f} %, "
            f"tracking error {point.tracking_error_cm:.2f} cm",
            flush=True,
        )

    def write_results(self) -> None:
        """Write those of the best and the last policy and the curve that are not there, or not as the state has them.

        Each may have been lost, damaged, or written after the state that is gone on from.
        """
        if not (is_first() and self.points):
            return
        for networks, point, name in ((self.last, self.points[-1], LAST), (self.best, _best(self.points), BEST)):
            checkpoint = Checkpoint(
                policy=networks.policy,
                value=networks.value,
                steps=point.steps,
                success=point.success,
                experiment=self.config.name,
                observation_size=self.env.observation_size,
                settings=self.settings,
            )
            if not is_saved(checkpoint, self.folder.path / name):
                save_checkpoint(checkpoint, self.folder.path / name)
        _write_curve(self.points, self.folder.path / CURVE)

    def _say_memory(self) -> None:
        if (needed := self.learner.memory()) is not None:
            each = needed * self.learner.mesh.size / self.config.ppo.num_envs
            print(f"  an update needs {needed / 1e6:,.0f} MB, {each / 1e3:,.0f} kB for each world", flush=True)

    def _save(self) -> None:
        state = _Saved(learner=gathered(self.state), best=self.best, last=self.last)
        if is_first():
            points = [dataclasses.asdict(point) for point in self.points]
            self.folder.save(self.steps, state, {"points": points, "seconds": time.monotonic() - self.start})


def _best(points: Sequence[Point]) -> Point:
    """The first of the best evaluations."""
    return min(points, key=lambda point: (-point.success, point.tracking_error_cm))


def _write_curve(points: Sequence[Point], path: Path) -> None:
    names = [field.name for field in dataclasses.fields(Point)]
    lines = [",".join(names), *(",".join(f"{value:g}" for value in dataclasses.astuple(p)) for p in points)]
    text = "\n".join(lines) + "\n"
    if not (path.is_file() and path.read_bytes() == text.encode()):
        with replacing(path) as temporary:
            temporary.write_text(text)


def main(config: Config) -> Mapping[str, str]:
    """Join the other processes, if there are any, and train; what the last evaluation said."""
    join(config.distributed)
    with watching_others(config.distributed), first_alone_speaks():
        last = train(config)[-1]
    return {
        "steps": f"{last.steps:,}",
        "success": f"{100 * last.success:.1f} %",
        "tracking error": f"{last.tracking_error_cm:.2f} cm",
    }


def command_line() -> None:
    """The command, with this process's arguments."""
    sweepable_command(main)


if __name__ == "__main__":
    command_line()
