"""Put an experiment's best policy among those that come with the project.

    python -m tools.bundle_policy config=pinch seed=1 [hand=allegro]

writes it, and a held-out demonstration, into train/policies: of those that it follows and that are lost without a
policy the one of median tracking error.
"""

import dataclasses
from pathlib import Path

import numpy as np

from envs.demonstrations.load_env import people_of_set
from envs.evaluation.evaluate import evaluate_in
from envs.evaluation.roll_out import make_roll_out, zero_residual
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration, save_demonstration
from mjx_hand.robots.robot_hand import known_robots
from train.experiment import bundled_policies
from train.experiment.evaluate_seeds import middle
from train.experiment.setup import load_env, rolled_out, settled
from train.learning.checkpoint import Checkpoint, save_checkpoint
from train.settings.config import Config, command


def include(checkpoint: Checkpoint, demonstration: Demonstration, name: str, hand: str = HUMAN) -> list[Path]:
    """Write both files. The value network, which only training needs, is left out."""
    bundled_policies.FOLDER.mkdir(exist_ok=True)
    policy, shown = bundled_policies.policy_path(name, hand), bundled_policies.demonstration_path(name, hand)
    save_checkpoint(dataclasses.replace(checkpoint, value={}), policy)
    save_demonstration(demonstration, shown)
    return [policy, shown]


def main(config: Config) -> None:
    """Choose the demonstration and write."""
    if config.hand not in (HUMAN, *known_robots()):
        raise InputError(f"hand is {config.hand!r}; policies come along for {', '.join((HUMAN, *known_robots()))}")
    env = load_env(config, "heldout")
    checkpoint, _, scores = rolled_out(config, env)
    idle = evaluate_in(env, make_roll_out(env, zero_residual)(None))
    followed = scores.scores["manip_trans_object"] & (np.array(scores.failure) == "")
    if not followed.any():
        raise InputError(f"{config.name}: this policy follows no held-out demonstration; train it further")
    lost = followed & ~idle.scores["manip_trans_object"]
    shown = np.flatnonzero(lost if lost.any() else followed)
    median = int(shown[middle(scores.scores["tracking_error_cm"][shown])])
    # What the person did: it is brought onto a robot wherever it is played.
    person, _ = people_of_set(config.data, "heldout", config.demonstrations, config.hand)[median]
    for path in include(checkpoint, person, config.name, config.hand):
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    command(main, settled)
