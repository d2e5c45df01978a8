"""Policies that come with the project, each with a demonstration to play; `tools.bundle_policy` adds one."""

import dataclasses
from pathlib import Path

from envs.demonstrations.load_env import env_of
from envs.demonstrations.twin_hands import twins
from envs.tracking import TrackingEnv
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.motion.demonstration import Demonstration, load_demonstration
from mjx_hand.rigid.rigid_hand import RigidHand
from train.experiment.setup import chosen_path
from train.settings.config import Config

FOLDER = Path(__file__).parent.parent / "policies"


def bundled_policy(name: str, hand: str = HUMAN) -> Path | None:
    """The policy of this experiment, for this hand, that comes with the project, if one does."""
    path = policy_path(name, hand)
    return path if path.is_file() else None


def bundled_env(config: Config) -> TrackingEnv:
    """The environment over the one demonstration that comes with the experiment's policy."""
    demonstration = load_demonstration(demonstration_path(config.name, config.hand))
    return env_of([demonstration], config.engine, config.task, hand=config.hand)


def bundled_people(config: Config) -> list[tuple[Demonstration, RigidHand]]:
    """What a person did, and the hand, in the demonstration that comes with the experiment's policy."""
    demonstrations = [load_demonstration(demonstration_path(config.name, config.hand))]
    return list(zip(demonstrations, twins(demonstrations), strict=True))


def policy_path(name: str, hand: str = HUMAN) -> Path:
    """Where this experiment's policy for a hand is, or would be."""
    return FOLDER / f"{_called(name, hand)}.npz"


def demonstration_path(name: str, hand: str = HUMAN) -> Path:
    """Where the person's demonstration is that comes with this experiment's policy."""
    return FOLDER / f"{_called(name, hand)}.demonstration.npz"


def with_policy(config: Config) -> tuple[Config, bool]:
    """The configuration with the policy to use: its own, or where nothing is trained, and one comes with the project,
    that one; and whether it is that one."""
    included = bundled_policy(config.name, config.hand)
    if config.checkpoint or included is None or chosen_path(config).is_file():
        return config, False
    print(f"nothing is trained in {config.out}: taking the policy that comes with mjx-hand", flush=True)
    return dataclasses.replace(config, checkpoint=str(included)), True


def _called(name: str, hand: str) -> str:
    """A robot hand's policies are called by its description's name as well; the path of a description names none."""
    return name if hand == HUMAN else f"{name}-{hand}"
