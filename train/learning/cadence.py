"""How often a training is evaluated: as often as fits into a tenth of its time, at any number of worlds.

Time is counted in control steps of worlds, not measured, so that a seed gives the same curve on every start. On a
processor a step costs the same for each world. An accelerator is full only from some number of worlds on: fewer take as
long. What evaluations took is told at the end of a training.
"""

import math

import jax

from envs.tracking import TrackingEnv
from train.settings.options import Checks, Ppo

SHARE = 0.1  # of the time of a training, for its evaluations
FULL = 2048  # worlds whose steps take an accelerator about as long as those of one


def rollouts_per_demonstration(env: TrackingEnv) -> int:
    """How many rollouts of each demonstration an evaluation has: as many as cost next to nothing."""
    return max(_full(env) // env.num_demonstrations, 1)


def updates_between(checks: Checks, ppo: Ppo, env: TrackingEnv, repeats: int) -> int:
    """Updates from one evaluation to the next."""
    if checks.every is not None:
        return max(checks.every // ppo.steps_per_update, 1)
    evaluation = env.num_frames * max(env.num_demonstrations * repeats, _full(env))
    update = ppo.unroll_length * max(ppo.num_envs, _full(env))
    return max(math.ceil(evaluation * (1 - SHARE) / (update * SHARE)), 1)


def _full(env: TrackingEnv) -> int:
    """Worlds that a step costs at least; the native engine's are stepped by the host's cores."""
    return 1 if jax.default_backend() == "cpu" or env.engine.name == "native" else FULL
