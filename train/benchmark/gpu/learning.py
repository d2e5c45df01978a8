"""How fast PPO is on an engine and what the learner's share of it is, and how long a policy takes to learn."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from envs.demonstrations.dataset import make_missing_sets
from envs.tracking import TrackingEnv
from mjx_hand.view.figures import plots
from train.benchmark.contestants import environment, physics
from train.benchmark.gpu.bench import Bench
from train.benchmark.gpu.record import Record, Table
from train.benchmark.gpu.scale import gpu_config
from train.benchmark.learning import measure_learning
from train.experiment.setup import training_env
from train.learning.curve import Point, is_finished
from train.ppo import train
from train.settings.config import Config

_SAVING = 15.0  # seconds that a training is left for its last evaluation and for saving
SPEED_COLUMNS = (
    *("grasp", "set-up", "worlds", "control steps/s", "least", "greatest"),
    *("physics, about", "learner, about", "compiling, s"),
)


def speed(bench: Bench, engine: str, setup: str, worlds: int, table: Table) -> None:
    """PPO's control steps a second on the pinch, a row of the table."""
    made = bench.env(engine, "pinch")
    config = gpu_config("pinch", bench.scale, bench.demonstrations, bench.out)
    alone = bench.contestants.get((engine, "pinch", worlds)) or physics(made, worlds)
    around = environment(made, worlds)
    found = measure_learning(config, made, alone, around, bench.scale.runs, bench.scale.seconds)
    shares = (f"{found.physics_share:.0%}", f"{found.learner_share:.0%}")
    rate = found.rate
    table.add("pinch", setup, worlds, rate.median, rate.least, rate.greatest, *shares, found.compile_seconds)


@dataclasses.dataclass(frozen=True)
class Moment:
    """An evaluation: when it was done (s since the training was begun here), and evaluations' seconds until then."""

    seconds: float
    evaluating: float
    point: Point


def to_success(
    bench: Bench, name: str, folder: str, record: Record, keep: Callable[[], None], further: bool = False
) -> None:
    """Train an experiment until it is learned, or time is over, and tell where the time went.

    Args:
        bench: sizes and time.
        name: of the experiment.
        folder: of the training, below the benchmark's own.
        record: for the results.
        keep: called as they come.
        further: go on from where the experiment was left, for many more steps.
    """
    config = gpu_config(name, bench.scale, bench.demonstrations, bench.out / folder)
    config = _longer(config, bench.scale.long_steps) if further else dataclasses.replace(config, fresh=True)
    with bench.timed() as making:
        env = _env(bench, config, record)
    engine = env.engine.name
    config = dataclasses.replace(config, engine=engine)
    table = record.table("steps", "seconds", "of them evaluating", "success", "tracking error, cm")
    moments: list[Moment] = []
    began = bench.budget.clock()

    def watch(points: Sequence[Point], evaluating: float) -> bool:
        if not moments or points[-1] is not moments[-1].point:
            moment = Moment(bench.budget.clock() - began, evaluating, points[-1])
            moments.append(moment)
            last = moment.point
            table.add(last.steps, moment.seconds, evaluating, last.success, last.tracking_error_cm)
            bench.say(f"{record.name}: {last.steps:,} steps, success {last.success:.0%}")
            keep()
        return not bench.budget.fits(_SAVING)

    points = train(config, env, watch)
    record.notes.insert(0, _story(config, engine, making[0], moments, points, bench.scale.learned))
    if not is_finished(config, points):
        record.left_out.append(f"what comes after {points[-1].steps:,} steps")
    steps, success = (np.array([getattr(p, field) for p in points], float) for field in ("steps", "success"))
    record.figures[f"curve-{record.name}"] = plots.learning_curve(steps, success)


def _longer(config: Config, steps: int) -> Config:
    """The same for more steps, whatever it has learned."""
    ppo, checks = (
        dataclasses.replace(config.ppo, num_timesteps=steps),
        dataclasses.replace(config.checks, stop_at=2.0),
    )
    return dataclasses.replace(config, ppo=ppo, checks=checks)


def _env(bench: Bench, config: Config, record: Record) -> TrackingEnv:
    """The training part, made once, on the engine that the experiment names, or else on the measured one."""
    if config.name not in bench.trained:
        engine = bench.scale.training_engine or (bench.engine if config.engine == "auto" else config.engine)
        if engine != bench.engine:
            record.notes.append(f"Physics is {engine}: {bench.engine} cannot, or would take minutes here.")
        make_missing_sets(config.data, config.demonstrations)
        bench.trained[config.name] = training_env(dataclasses.replace(config, engine=engine))
    return bench.trained[config.name]


def _story(
    config: Config, engine: str, making: float, moments: Sequence[Moment], points: Sequence[Point], learned: float
) -> str:
    """Where the time went, in a sentence or two."""
    first = moments[0]
    told = (
        f"{config.name} on {engine}, {config.ppo.num_envs:,} worlds; environment made in {making:.1f} s; compiling, "
        f"the first update and the first evaluation took {first.seconds:.1f} s."
    )
    done = next((m for m in moments if m.point.success >= learned), None)
    if done is None:
        return f"{told} {learned:.0%} was not reached: {max(p.success for p in points):.0%} at best."
    evaluating = done.evaluating - first.evaluating
    learning = done.seconds - first.seconds - evaluating
    return (
        f"{told} {learned:.0%} of the demonstrations after {done.seconds:.1f} s and {done.point.steps:,} steps: after "
        f"the first update {learning:.1f} s of learning (states saved as well) and {evaluating:.1f} s of evaluations."
    )
