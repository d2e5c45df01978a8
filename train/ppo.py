"""Train a residual tracking policy with Brax PPO: `python -m train.ppo config=pinch ppo.num_envs=512 seed=3`.

Writes to the experiment's `out` folder: `best.npz` and `last.npz` (checkpoints), `curve.csv` (evaluations),
`config.yaml`, and TensorBoard logs.
"""

import contextlib
import dataclasses
import math
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import jax
import numpy as np
from brax.training.agents.ppo import train as brax_ppo
from omegaconf import OmegaConf
from tensorboardX import SummaryWriter

from envs.evaluation import evaluate
from envs.parallel import ParallelEnv
from envs.rolling import make_roll_out
from mjx_hand.errors import InputError
from mjx_hand.motion.archive import replacing
from mjx_hand.view.progress import counter
from train.checkpoint import Checkpoint, save_checkpoint
from train.config import Config, command
from train.experiment import World, make_world
from train.policy import deterministic_policy, network_factory

_LOG_EVERY = 8  # PPO updates between two lines of training metrics


@dataclasses.dataclass(frozen=True)
class Point:
    """One evaluation on the training demonstrations: steps and seconds so far, and scores."""

    steps: int
    seconds: float
    success: float
    tracking_error_cm: float
    rotation_error_deg: float


class _Solved(Exception):
    """Raised out of Brax's loop once `checks.stop_at` is reached."""


def train(config: Config, world: World | None = None) -> list[Point]:
    """Train, and return the evaluations, the first before any learning.

    Args:
        config: the experiment.
        world: its training part, where the caller has made it already.

    Raises:
        InputError: an `out` folder that cannot be written, or whatever is wrong with the configuration.
    """
    out = Path(config.out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write {out}: {error.strerror}; choose another folder with out=FOLDER") from None
    world = make_world(config, "train") if world is None else world
    with replacing(out / "config.yaml") as temporary:
        temporary.write_text(OmegaConf.to_yaml(OmegaConf.structured(config)))
    print(
        f"training {config.name!r} on {world.env.num_demonstrations} demonstrations, engine {world.env.engine.name}, "
        f"{config.ppo.num_envs} worlds; results in {out}",
        flush=True,
    )
    with SummaryWriter(str(out / "tensorboard")) as writer, counter(config.ppo.num_timesteps, "training") as advance:
        watch = _Watch(config, world, out, writer, advance)
        with contextlib.suppress(_Solved):
            learn(config, world, watch)
    return watch.points


@runtime_checkable
class Listener(Protocol):
    """What `learn` tells how it goes."""

    def log(self, steps: int, metrics: Mapping[str, Any]) -> None:
        """Training metrics, now and then and after each stretch between evaluations."""
        ...

    def evaluate(self, steps: int, make_policy: Any, parameters: Any) -> None:
        """Called before the first step and every `checks.every` steps."""
        ...


def learn(config: Config, world: World, watch: Listener) -> None:
    """Brax PPO on a world, with nothing written but what `watch` writes."""
    ppo = config.ppo
    update = ppo.num_envs * ppo.unroll_length
    evaluations = max(math.ceil(ppo.num_timesteps / max(config.checks.every, update)), 1)
    brax_ppo.train(
        environment=ParallelEnv(world.env),
        wrap_env=False,
        num_timesteps=ppo.num_timesteps,
        num_envs=ppo.num_envs,
        episode_length=int(np.max(world.env.reference.length)),
        unroll_length=ppo.unroll_length,
        batch_size=ppo.num_envs // ppo.num_minibatches,
        num_minibatches=ppo.num_minibatches,
        num_updates_per_batch=ppo.num_updates_per_batch,
        learning_rate=ppo.learning_rate,
        entropy_cost=ppo.entropy_cost,
        discounting=ppo.discounting,
        gae_lambda=ppo.gae_lambda,
        clipping_epsilon=ppo.clipping_epsilon,
        max_grad_norm=ppo.max_grad_norm,
        normalize_observations=False,
        network_factory=network_factory(ppo),
        seed=config.seed,
        # Brax's evaluator runs training episodes, some of which start mid-grasp; ours starts all at frame 0.
        run_evals=False,
        num_evals=evaluations + 1,
        policy_params_fn=watch.evaluate,
        log_training_metrics=True,
        training_metrics_steps=_LOG_EVERY * update,
        progress_fn=watch.log,
    )


class _Watch:
    """Brax's callbacks: logs, evaluations, checkpoints."""

    def __init__(self, config: Config, world: World, out: Path, writer: SummaryWriter, advance: Callable[[int], None]):
        self.config, self.world, self.out = config, world, out
        self.writer, self.advance = writer, advance
        self.points: list[Point] = []
        self.seen = 0
        self.start = time.monotonic()
        env = world.env
        policy = deterministic_policy(config.ppo, env.observation_size, env.action_size)
        self.roll_out = make_roll_out(env, world.hands, policy)

    def log(self, steps: int, metrics: Mapping[str, Any]) -> None:
        """Training metrics, a few times a second of work."""
        self.advance(min(int(steps), self.config.ppo.num_timesteps) - self.seen)
        self.seen = min(int(steps), self.config.ppo.num_timesteps)
        for name, value in metrics.items():
            if np.ndim(value) == 0:
                self.writer.add_scalar(name, float(value), int(steps))

    def evaluate(self, steps: int, make_policy: Any, parameters: Any) -> None:
        """All training demonstrations from frame 0; keeps the best policy, because curves are not monotone."""
        policy, value = parameters[1], parameters[2]
        scores = evaluate(self.roll_out(policy), [d.object for d in self.world.demonstrations]).rows()
        point = Point(
            steps=int(steps),
            seconds=time.monotonic() - self.start,
            success=scores["manip_trans_object"],
            tracking_error_cm=scores["tracking_error_cm"],
            rotation_error_deg=scores["object_rotation_error_deg"],
        )
        best = min((_rank(p) for p in self.points), default=None)
        self.points.append(point)
        for name, score in scores.items():
            self.writer.add_scalar(f"evaluation/{name}", score, int(steps))
        checkpoint = Checkpoint(
            policy=jax.tree.map(np.asarray, policy),
            value=jax.tree.map(np.asarray, value),
            steps=int(steps),
            success=point.success,
            experiment=self.config.name,
            observation_size=self.world.env.observation_size,
        )
        save_checkpoint(checkpoint, self.out / "last.npz")
        if best is None or _rank(point) < best:
            save_checkpoint(checkpoint, self.out / "best.npz")
        _write_curve(self.points, self.out / "curve.csv")
        print(
            f"  {point.steps:>9,} steps, {point.seconds:4.0f} s: success {100 * point.success:5.1f} %, "
            f"tracking error {point.tracking_error_cm:.2f} cm",
            flush=True,
        )
        if point.success >= self.config.checks.stop_at:
            raise _Solved


def _rank(point: Point) -> tuple[float, float]:
    return (-point.success, point.tracking_error_cm)


def _write_curve(points: list[Point], path: Path) -> None:
    names = [field.name for field in dataclasses.fields(Point)]
    lines = [",".join(names), *(",".join(f"{value:g}" for value in dataclasses.astuple(p)) for p in points)]
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    command(train)
