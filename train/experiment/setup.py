"""What training, evaluation and play share: the experiment's demonstrations, its environments, and its policy."""

import dataclasses
from pathlib import Path

from envs.demonstrations.load_env import env_of_set
from envs.demonstrations.load_set import is_divided
from envs.evaluation.evaluate import Evaluation, evaluate
from envs.evaluation.roll_out import make_roll_out
from envs.evaluation.rollout import Rollouts
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from train.learning.checkpoint import Checkpoint, load_checkpoint
from train.learning.policy import deterministic_policy
from train.settings.config import Config


def load_env(config: Config, part: str) -> TrackingEnv:
    """The environment over one part ("train", "heldout") of the experiment's demonstrations.

    Raises:
        InputError: a set that is not made, or as `TrackingEnv`.
    """
    if part == "heldout" and config.data.folder and not is_divided(config.data.folder):
        print(f"{config.data.folder} holds no demonstrations out: these are the ones for training", flush=True)
    return env_of_set(config.data, part, config.engine, config.task, config.demonstrations)


def without_grip(env: TrackingEnv) -> TrackingEnv:
    """The same with demonstrations replayed as they are, without the forces that the reference adds."""
    task = dataclasses.replace(env.task, grip_force=0.0)
    return TrackingEnv(env.demonstrations, env.hands, env.engine.name, task)


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


def rolled_out(config: Config, env: TrackingEnv) -> tuple[Checkpoint, Rollouts, Evaluation]:
    """The chosen policy, a rollout of each demonstration under it, and their scores.

    Raises:
        InputError: as `chosen_checkpoint`.
    """
    checkpoint = chosen_checkpoint(config, env.observation_size)
    policy = deterministic_policy(config.ppo, env.observation_size, env.action_size)
    rollouts = make_roll_out(env, policy)(checkpoint.policy)
    return checkpoint, rollouts, evaluate(rollouts, [demonstration.object for demonstration in env.demonstrations])
