"""Measures and draws docs/axes.md's figure: `python docs/figures/axes.py RECORDING` (any recording with rotations)."""

import sys
from pathlib import Path

import jax.numpy as jnp
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from mjx_hand import fit_functional_axes, load_hand, load_motion, project
from mjx_hand.hand.joints import FINGERS, LINKS, ONE_DOF, TWO_DOF
from mjx_hand.retarget.sequence import rigid_hand_of
from mjx_hand.rigid.rigid_hand import RigidHand, joint_rotations
from mjx_hand.rotations import geodesic_angle

HERE = Path(__file__).parent
HANDS = ("axes of the rest pose", "functional axes alone", "functional axes and rest rotations")
COLOURS = ("C3", "C1", "C0")


def errors(rigid: RigidHand, rotations: np.ndarray) -> np.ndarray:
    """Degrees, (frames, 15)."""
    recorded = jnp.asarray(rotations, jnp.float32)
    return np.degrees(geodesic_angle(recorded, joint_rotations(project(recorded, rigid), rigid)))


def held_out(rigid: RigidHand, rotations: np.ndarray, fit: slice, test: slice) -> list[np.ndarray]:
    """Errors on the frames `test` of the three hands, fitted to the frames `fit`."""
    fitted = [fit_functional_axes(rigid, rotations[fit], rest_rotation=rest) for rest in (False, True)]
    return [errors(hand, rotations[test]) for hand in (rigid, *fitted)]


def print_table(ways: list[list[np.ndarray]]) -> None:
    """Mean / largest error (degrees) of each hand, way by way, as Markdown."""
    for name, *found in zip(HANDS, *ways, strict=True):
        for group, joints in (("two hinges", TWO_DOF), ("one hinge", ONE_DOF), ("all", range(15))):
            cells = [f"{e[:, list(joints)].mean():.2f} / {e[:, list(joints)].max():.2f}" for e in found]
            print(f"| {name}, {group} | {' | '.join(cells)} |")


def draw(ways: list[list[np.ndarray]]) -> None:
    """Mean error of each joint, both ways together, and where nine of ten frames lie."""
    order = [3 * FINGERS.index(f) + k for f in ("thumb", "index", "middle", "ring", "pinky") for k in range(3)]
    figure, axes = plt.subplots(figsize=(8.6, 3.6), layout="constrained")
    for k, (name, colour) in enumerate(zip(HANDS, COLOURS, strict=True)):
        found = np.concatenate([way[k] for way in ways])[:, order]
        place = np.arange(15) + 0.27 * (k - 1)
        axes.bar(place, found.mean(axis=0), 0.25, color=colour, label=name)
        low, high = np.percentile(found, [5, 95], axis=0)
        axes.vlines(place, low, high, color="0.25", lw=0.9)
    axes.set_xticks(range(15), [LINKS[1 + j] for j in order], rotation=45, ha="right", fontsize=8)
    axes.set(ylabel="error on frames not fitted (degrees)", ylim=(0, None), xlim=(-0.6, 14.6))
    axes.legend(frameon=False, fontsize=8)
    axes.grid(axis="y", alpha=0.3)
    axes.set_axisbelow(True)
    figure.savefig(HERE / "axes.png", dpi=110)


def main(recording: str) -> None:
    """Both halves of a recording, each fitted and the other tested."""
    motion = load_motion(recording)
    rigid = rigid_hand_of(motion, load_hand(side=motion.side))
    rotations = motion.rotations[motion.valid]
    first, second = slice(0, len(rotations) // 2), slice(len(rotations) // 2, None)
    ways = [held_out(rigid, rotations, first, second), held_out(rigid, rotations, second, first)]
    print_table(ways)
    draw(ways)


if __name__ == "__main__":
    main(sys.argv[1])
