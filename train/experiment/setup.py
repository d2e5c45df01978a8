"""What training, evaluation and play share: the demonstrations of an experiment, their twins, and environments."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from envs.demonstrations.dataset import load_part, make_set
from envs.demonstrations.twin_hands import twins
from envs.evaluation.evaluate import Evaluation, evaluate
from envs.evaluation.roll_out import make_roll_out
from envs.evaluation.rollout import Rollouts
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.progress import shares
from mjx_hand.rigid.rigid_hand import RigidHand
from train.learning.checkpoint import Checkpoint, load_checkpoint
from train.learning.policy import deterministic_policy
from train.settings.config import Config


@dataclasses.dataclass(frozen=True)
class TrackingSetup:
    """Demonstrations, the twin's hand for each, and the environment over them."""

    demonstrations: Sequence[Demonstration]
    hands: Sequence[RigidHand]
    env: TrackingEnv


def make_setup(config: Config, part: str) -> TrackingSetup:
    """The environment over one part ("train", "heldout") of the experiment's demonstrations, made where missing.

    Of all grasp types together, they stand one type after the other.
    """
    demonstrations = []
    for settings in config.data.expand_types():
        with shares() as report:
            folder = make_set(settings, config.demonstrations, report)
        demonstrations += load_part(folder, part)
    hands = twins(demonstrations)
    return TrackingSetup(demonstrations, hands, TrackingEnv(demonstrations, hands, config.engine, config.task))


def without_grip(setup: TrackingSetup) -> TrackingSetup:
    """The same with demonstrations replayed as they are, without the forces that the reference adds."""
    task = dataclasses.replace(setup.env.task, grip_force=0.0)
    env = TrackingEnv(setup.demonstrations, setup.hands, setup.env.engine.name, task)
    return dataclasses.replace(setup, env=env)


def chosen_checkpoint(config: Config, observation_size: int) -> Checkpoint:
    """The checkpoint to evaluate: `checkpoint=FILE`, or the best of the experiment's folder.

    Raises:
        InputError: there is none, or it was trained on other observations.
    """
    path = Path(config.checkpoint) if config.checkpoint else Path(config.out) / "best.npz"
    checkpoint = load_checkpoint(path)
    if checkpoint.observation_size != observation_size:
        raise InputError(
            f"{path}: reads {checkpoint.observation_size} observations, this task gives {observation_size}; "
            "use the task options it was trained with, or train again"
        )
    return checkpoint


def rolled_out(config: Config, setup: TrackingSetup) -> tuple[Checkpoint, Rollouts, Evaluation]:
    """The chosen policy, a rollout of each demonstration under it, and their scores.

    Raises:
        InputError: as `chosen_checkpoint`.
    """
    checkpoint = chosen_checkpoint(config, setup.env.observation_size)
    policy = deterministic_policy(config.ppo, setup.env.observation_size, setup.env.action_size)
    rollouts = make_roll_out(setup.env, setup.hands, policy)(checkpoint.policy)
    return checkpoint, rollouts, evaluate(rollouts, [demonstration.object for demonstration in setup.demonstrations])
