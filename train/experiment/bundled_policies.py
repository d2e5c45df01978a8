"""Policies that come with the project, each with a demonstration to play; `tools.bundle_policy` adds one."""

import dataclasses
from pathlib import Path

from envs.demonstrations.twin_hands import twins
from envs.tracking import TrackingEnv
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.motion.demonstration import load_demonstration
from train.experiment.setup import chosen_path
from train.settings.config import Config

FOLDER = Path(__file__).parent.parent / "policies"


def bundled_policy(name: str) -> Path | None:
    """The policy of this experiment that comes with the project, if one does."""
    path = FOLDER / f"{name}.npz"
    return path if path.is_file() else None


def bundled_env(config: Config) -> TrackingEnv:
    """The environment over the one demonstration that comes with the experiment's policy."""
    demonstrations = [load_demonstration(demonstration_path(config.name))]
    return TrackingEnv(demonstrations, twins(demonstrations), config.engine, config.task)


def demonstration_path(name: str) -> Path:
    """Where the demonstration is that comes with this experiment's policy."""
    return FOLDER / f"{name}.demonstration.npz"


def with_policy(config: Config) -> tuple[Config, bool]:
    """The configuration with the policy to use: its own, or where nothing is trained, and one comes with the project,
    that one; and whether it is that one."""
    included = bundled_policy(config.name)
    if config.checkpoint or config.hand != HUMAN or included is None or chosen_path(config).is_file():
        return config, False
    print(f"nothing is trained in {config.out}: taking the policy that comes with mjx-hand", flush=True)
    return dataclasses.replace(config, checkpoint=str(included)), True
