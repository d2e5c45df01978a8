"""Policies that come with the project, each with a demonstration to play.

    python -m train.included config=pinch seed=1

puts an experiment's best policy and its held-out demonstration of median tracking error among them.
"""

import dataclasses
from pathlib import Path

from envs.demonstrations.twin_hands import twins
from envs.tracking import TrackingEnv
from mjx_hand.motion.demonstration import Demonstration, load_demonstration, save_demonstration
from train.checkpoint import Checkpoint, save_checkpoint
from train.config import Config, command
from train.experiment import World, make_world, rolled_out
from train.seeds import median_and_worst

FOLDER = Path(__file__).parent / "policies"


def included_policy(name: str) -> Path | None:
    """The policy of this experiment that comes with the project, if one does."""
    path = FOLDER / f"{name}.npz"
    return path if path.is_file() else None


def included_world(config: Config) -> World:
    """The environment over the one demonstration that comes with the experiment's policy."""
    demonstrations = [load_demonstration(_demonstration_path(config.name))]
    hands = twins(demonstrations)
    return World(demonstrations, hands, TrackingEnv(demonstrations, hands, config.engine, config.task))


def include(checkpoint: Checkpoint, demonstration: Demonstration, name: str) -> list[Path]:
    """Write both files. The value network, which only training needs, is left out."""
    FOLDER.mkdir(exist_ok=True)
    save_checkpoint(dataclasses.replace(checkpoint, value={}), FOLDER / f"{name}.npz")
    save_demonstration(demonstration, _demonstration_path(name))
    return [FOLDER / f"{name}.npz", _demonstration_path(name)]


def _demonstration_path(name: str) -> Path:
    return FOLDER / f"{name}.demonstration.npz"


def main(config: Config) -> None:
    """Choose the demonstration and write."""
    world = make_world(config, "heldout")
    checkpoint, _, scores = rolled_out(config, world)
    _, median = median_and_worst({config.seed: scores})["median"]
    for path in include(checkpoint, world.demonstrations[median], config.name):
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    command(main)
