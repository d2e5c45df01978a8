"""Which way a robot hand's links point, and whether a description and a recording go with them.

Seen from its first joint, a finger's tip is farthest where the finger is straight, and on the palm's side of that
everywhere else. With the fingers' order this tells left from right, whatever the description says.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.pytree import replace
from mjx_hand.robots.robot_hand import RobotHand
from mjx_hand.robots.robot_urdf import robot_tree
from mjx_hand.robots.solver.kinematic_tree import HELD, KinematicTree, ancestors, tree_points
from mjx_hand.robots.solver.posture_samples import spread_postures

_ORDER = ("index", "middle", "ring", "little")
_FARTHEST = 60.0  # degrees between what a description says and what the links do
_LEAST = 0.1  # of a finger's length; what is shorter says nothing
_AGREE = 0.5  # length of a mean of unit vectors below which they have no common direction


@dataclass(frozen=True)
class HandAxes:
    """Unit directions in the root link's frame, and the side; None where the links do not tell.

    Attributes:
        fingers: of straight fingers.
        palmar: the way in which they bend.
        side: "right" or "left".
    """

    fingers: Float[np.ndarray, "3"] | None
    palmar: Float[np.ndarray, "3"] | None
    side: str | None


def check_goes_with(robot: RobotHand, urdf: str | Path, side: str) -> None:
    """Look whether description, URDF and a recording of this side belong together.

    Raises:
        InputError: the description's directions are not the links', or the robot is a hand of the other side.
    """
    found = hand_axes(robot, urdf)
    check_directions(robot, urdf, found)
    if found.side not in (None, side):
        raise InputError(
            f"the recording is of a {side} hand, and {urdf} with {robot.name} is a {found.side} hand; give a {side} "
            f"hand's URDF and description, or record a {found.side} hand"
        )


def check_directions(robot: RobotHand, urdf: str | Path, found: HandAxes) -> None:
    """Raise InputError where the description's directions are not what the links tell."""
    for name, said, seen in (("fingers", robot.fingers, found.fingers), ("palmar", robot.palmar, found.palmar)):
        if seen is None:
            continue
        angle = np.degrees(np.arccos(np.clip(said @ seen, -1, 1)))
        if angle > _FARTHEST:
            raise InputError(
                f"{robot.name}: {name} is {_listed(said)}, {angle:.0f} degrees from what the links of {urdf} do, "
                f"{_listed(seen)}; correct it, or give the URDF that belongs to the description"
            )


def hand_axes(robot: RobotHand, urdf: str | Path) -> HandAxes:
    """What the links of a robot hand tell of its directions and its side.

    Raises:
        InputError: see `robot_tree`.
    """
    digits = {keypoint.split("_")[0]: link for link, keypoint in robot.tips.items()}
    fingers = [digit for digit in _ORDER if digit in digits]
    if not fingers:
        return HandAxes(None, None, None)
    tree = robot_tree(
        urdf, [digits[digit] for digit in (*fingers, *(["thumb"] if "thumb" in digits else []))], robot.palm
    )
    tips, knuckles = _places(tree)
    reach = tips - knuckles
    count = len(fingers)
    open_and_axis = [_open_finger(reach[:, f]) for f in range(count)]
    along = _direction(np.mean([way for way, _ in open_and_axis], axis=0))
    axis = _direction(np.mean([axis for _, axis in open_and_axis], axis=0))
    out = None if along is None or axis is None else _direction(np.cross(axis, along))
    if along is None or out is None or (count == 1 and "thumb" not in digits):
        return HandAxes(along, out, None)
    places = tips.mean(axis=0)
    across = places[0] - places[count - 1] if count > 1 else places[-1] - places[0]
    towards_thumb = float(across @ np.cross(along, out))
    if abs(towards_thumb) < _LEAST * np.linalg.norm(reach, axis=-1).max():
        return HandAxes(along, out, None)
    return HandAxes(along, out, "right" if towards_thumb > 0 else "left")


def _open_finger(reach: Float[np.ndarray, "m 3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """The direction of a straight finger that is not bent at its base, and the axis about which it bends; unit."""
    length = np.linalg.norm(reach, axis=1)
    straight = np.argsort(-length)[: len(length) // 8]
    ways = reach[straight] / length[straight, None]
    middle = ways.mean(axis=0)
    axis = np.cross(middle, reach.mean(axis=0))  # bent fingers are on one side of straight ones
    size = np.linalg.norm(axis)
    axis = axis / size if size > _LEAST * length.max() ** 2 * 0.1 else np.zeros(3)
    bend = np.arctan2(np.cross(middle, ways) @ axis, ways @ middle)
    way = ways[np.argsort(bend)[: max(len(ways) // 4, 1)]].mean(axis=0)
    return way / max(float(np.linalg.norm(way)), 1e-9), axis


def _places(tree: KinematicTree) -> tuple[Float[np.ndarray, "m p 3"], Float[np.ndarray, "m p 3"]]:
    """Where the tree's points are in postures all over the joints' ranges, and the first joint that moves each."""
    chains = [ancestors(tree, joint) for joint in tree.point_joints]
    first = tuple(next((j for j in chain if tree.dofs[j] != HELD), -1) for chain in chains)
    both = replace(
        tree,
        point_position=np.concatenate([tree.point_position, np.zeros_like(tree.point_position)]),
        point_joints=(*tree.point_joints, *first),
        point_names=(*tree.point_names, *tree.point_names),
    )
    places = np.asarray(tree_points(spread_postures(tree), both), float)
    return places[:, : len(first)], places[:, len(first) :]


def _direction(mean: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"] | None:
    """The direction of a mean of unit vectors; None where they point all ways."""
    size = np.linalg.norm(mean)
    return mean / size if size > _AGREE else None


def _listed(vector: Float[np.ndarray, "3"]) -> str:
    return f"[{', '.join(f'{x:.2g}' for x in np.round(vector, 2) + 0.0)}]"
