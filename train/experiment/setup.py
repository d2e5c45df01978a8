"""What training, evaluation and play share: the experiment's demonstrations, its environments, and its policy."""

import dataclasses
from collections.abc import Collection
from pathlib import Path

import jax.numpy as jnp

from envs.demonstrations.load_env import env_of_set
from envs.demonstrations.load_set import is_divided
from envs.disturbances.randomize import Randomize
from envs.evaluation.evaluate import Evaluation, evaluate_in
from envs.evaluation.roll_out import make_roll_out
from envs.evaluation.rollout import Rollouts
from envs.tracking import TrackingEnv
from envs.twin import Tables
from mjx_hand.errors import InputError
from mjx_hand.player.observed_state import HUMAN_NAMES
from train.learning.checkpoint import Checkpoint, load_checkpoint
from train.learning.policy import check_policy, deterministic_policy
from train.learning.run_folder import BEST
from train.settings.config import Config
from train.settings.saved import FILE, contradiction, policy_settings, read_settings, with_settings_of


def load_env(config: Config, part: str, randomize: Randomize | None = None) -> TrackingEnv:
    """The environment over one part ("train", "heldout", "sealed") of the experiment's demonstrations.

    Args:
        config: the experiment.
        part: of its demonstrations.
        randomize: what disturbs episodes; nothing does by default, whatever the experiment trains with.

    Raises:
        InputError: a set that is not made, or as `TrackingEnv`.
    """
    if part == "heldout" and config.data.folder and not is_divided(config.data.folder):
        print(f"{config.data.folder} holds no demonstrations out: these are the ones for training", flush=True)
    return env_of_set(config.data, part, config.engine, config.task, config.demonstrations, randomize, config.hand)


def training_env(config: Config) -> TrackingEnv:
    """The environment that the experiment trains in: its training part, disturbed as `randomize` says.

    Raises:
        InputError: as `load_env`.
    """
    return load_env(config, "train", config.randomize if config.randomize.share else None)


def without_grip(env: TrackingEnv) -> Tables:
    """Its tables with demonstrations replayed as they are, without the forces that the reference adds."""
    reference = env.reference
    bare = dataclasses.replace(
        reference, controls=reference.controls - reference.grip, grip=jnp.zeros_like(reference.grip)
    )
    return dataclasses.replace(env.tables, reference=bare)


def chosen_path(config: Config) -> Path:
    """The policy to evaluate: `checkpoint=FILE`, or the best of the experiment's folder."""
    return Path(config.checkpoint) if config.checkpoint else Path(config.out) / BEST


def settled(config: Config, given: Collection[str]) -> Config:
    """The configuration with the settings of the run that it names, where the command line does not say others.

    Args:
        config: as composed.
        given: the options that the command line gave.

    Raises:
        InputError: an option was given that contradicts the run's.
    """
    policy = chosen_path(config)
    if (policy.parent / FILE).is_file():
        return with_settings_of(config, read_settings(policy.parent / FILE), given, str(policy.parent))
    if policy.is_file() and (settings := load_checkpoint(policy).settings):
        return with_settings_of(config, settings, given, str(policy))
    return config


def chosen_checkpoint(config: Config, observation_size: int, action_size: int = len(HUMAN_NAMES.targets)) -> Checkpoint:
    """The checkpoint of `chosen_path`, if it is of this experiment's task, demonstrations and network.

    Raises:
        InputError: there is none, or it is of others.
    """
    path = chosen_path(config)
    checkpoint = load_checkpoint(path)
    if checkpoint.experiment != config.name:
        raise InputError(
            f"{path}: is a policy of {checkpoint.experiment!r}, now {config.name!r}; give config="
            f"{checkpoint.experiment}, or a policy of this experiment"
        )
    if checkpoint.settings and (refused := contradiction(str(path), checkpoint.settings, policy_settings(config))):
        raise InputError(f"{refused}; use the options it was trained with, or train again")
    if checkpoint.observation_size != observation_size:
        raise InputError(
            f"{path}: reads {checkpoint.observation_size} observations, this task gives {observation_size}; "
            "use the task options it was trained with, or train again"
        )
    check_policy(path, checkpoint.policy, config.ppo, observation_size, action_size)
    return checkpoint


def rolled_out(config: Config, env: TrackingEnv) -> tuple[Checkpoint, Rollouts, Evaluation]:
    """The chosen policy, a rollout of each demonstration under it, and their scores.

    Raises:
        InputError: as `chosen_checkpoint`.
    """
    checkpoint = chosen_checkpoint(config, env.observation_size, env.action_size)
    policy = deterministic_policy(config.ppo, env.observation_size, env.action_size)
    rollouts = make_roll_out(env, policy)(checkpoint.policy)
    return checkpoint, rollouts, evaluate_in(env, rollouts)
