"""Policies that come with the project, each with a demonstration to play; `tools.bundle_policy` adds one."""

from pathlib import Path

from envs.demonstrations.twin_hands import twins
from envs.tracking import TrackingEnv
from mjx_hand.motion.demonstration import load_demonstration
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
