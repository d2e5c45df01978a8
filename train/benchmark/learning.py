"""How fast training is with learning included, and how much of it the physics takes."""

import dataclasses
import time

import jax

from envs.parallel import ParallelEnv
from envs.tracking import TrackingEnv
from train.benchmark.contestants import Contestant
from train.benchmark.timing import Rate, enough_steps, rate_once
from train.learning.learner import Learner
from train.settings.config import Config


@dataclasses.dataclass(frozen=True)
class Learning:
    """PPO's speed.

    Attributes:
        grasp: of which type.
        engine: on which.
        worlds: in parallel.
        compile_seconds: by how much the first update, which compiles, was longer than the median of the others.
        rate: control steps a second of the training loop; evaluations are left out.
        physics_share: the time that the engine alone needs for as many control steps of the script, over the time of
            the loop. An estimate: training visits other states than the script, with other contacts.
        learner_share: the time that is left when the environment alone, under random actions, has had its own; the
            policy's forward pass is in it. An estimate for the same reason.
    """

    grasp: str
    engine: str
    worlds: int
    compile_seconds: float
    rate: Rate
    physics_share: float
    learner_share: float


def measure_learning(
    config: Config, env: TrackingEnv, alone: Contestant, around: Contestant, runs: int, seconds: float
) -> Learning:
    """Make `runs` updates; between them engine and environment run alone, to compare at the same moment.

    Args:
        config: the experiment, for its engine and demonstrations.
        world: its training part.
        alone: the engine alone on as many worlds as PPO is to have.
        around: the environment on them.
        runs: timed updates.
        seconds: about how long each of the two runs between two updates.

    Raises:
        InputError: a number of worlds that PPO cannot split into its minibatches.
    """
    learner = Learner(ParallelEnv(env), dataclasses.replace(config.ppo, num_envs=alone.worlds))
    state = learner.initial(0)
    began = time.perf_counter()
    state, _ = jax.block_until_ready(learner.update(state, 0.0))
    first = time.perf_counter() - began
    steps, more = enough_steps(alone, seconds), enough_steps(around, seconds)
    trained, physics, environment = [], [], []
    for _ in range(runs):
        began = time.perf_counter()
        state, _ = jax.block_until_ready(learner.update(state, 0.0))
        trained.append(learner.steps_per_update / (time.perf_counter() - began))
        physics.append(rate_once(alone, steps))
        environment.append(rate_once(around, more))
    rate = Rate.of(trained)
    return Learning(
        grasp=config.data.grasp,
        engine=env.engine.name,
        worlds=alone.worlds,
        compile_seconds=first - learner.steps_per_update / rate.median,
        rate=rate,
        physics_share=Rate.of([t / a for t, a in zip(trained, physics, strict=True)]).median,
        learner_share=Rate.of([1 - t / e for t, e in zip(trained, environment, strict=True)]).median,
    )
