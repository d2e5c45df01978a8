"""A robot hand's `KinematicTree` from its URDF.

Only joints between the root and the links asked for are kept: the others cannot move them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yourdfpy
from yourdfpy.urdf import Joint

from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import shown
from mjx_hand.robots.robot_file import read_robot
from mjx_hand.robots.solver.kinematic_tree import BASE, HELD, KinematicTree, z_frame
from mjx_hand.robots.urdf_file import check_joint, limits_of

_POINT = 1e-3  # rad or m; a range below it is a single position
_SHOWN = 12  # how many of a robot's links a message names


def robot_tree(path: str | Path, links: Sequence[str], palm: str | None = None) -> KinematicTree:
    """The joints that move `links`, and the links' origins as points, in the frame of the URDF's root link.

    A mimic joint follows the joint that it names, through others if need be. A degree of freedom's limits are those of
    all joints that it drives, but for those in the tree's `overruled`.

    Args:
        path: of the URDF.
        links: those asked for.
        palm: a link that the root carries, on an arm or wrist perhaps: joints that would move it stand still, at zero
            or as near as their limits allow.

    Raises:
        InputError: no such file, not a URDF, a link that it does not have, links that nothing moves, a joint of an
            unknown type or without limits, mimic joints that follow each other or none, limits that exclude each other.
    """
    path = Path(path)
    robot = read_robot(path)
    names = [link.name for link in robot.links]
    if missing := [link for link in (*links, palm) if link is not None and link not in names]:
        listed = ", ".join(str(name)[:40] for name in names[:_SHOWN]) + (", …" if len(names) > _SHOWN else "")
        raise InputError(f"{path}: has no link {shown(missing[0])}; its links: {listed}")
    above = {joint.child: joint for joint in robot.joints}
    order: list[Joint] = []
    for link in links:
        known = {joint.name for joint in order}
        order += [joint for joint in _chain(path, link, above) if joint.name not in known]
    carrying = [] if palm is None else _chain(path, palm, above)
    for joint in (*order, *carrying):
        check_joint(path, joint)
    movable = [joint for joint in order if joint.type != "fixed"]
    tree = _tree(path, robot, movable, above, links, [joint for joint in carrying if joint.type != "fixed"])
    if not tree.dof_names:
        named = ", ".join(str(link)[:40] for link in links)
        raise InputError(f"{path}: no movable joint moves {named}; name the links of fingers that move")
    return tree


def _chain(path: Path, link: str, above: Mapping[str, Joint]) -> list[Joint]:
    """The joints from the root to `link`."""
    chain: list[Joint] = []
    while link in above:
        joint = above[link]
        if joint.name in {below.name for below in chain}:
            raise InputError(f"{path}: joint {shown(joint.name)} is above itself; a URDF's links must form a tree")
        chain.insert(0, joint)
        link = joint.parent
    return chain


@dataclass(frozen=True)
class _Drive:
    """What moves a joint: value = slope * (value of `leader`) + shift."""

    leader: str
    slope: float
    shift: float


def _drive(path: Path, joint: Joint, joints: Mapping[str, Joint]) -> _Drive:
    """The joint that leads `joint` in the end, itself where it mimics none."""
    slope, shift, followed = 1.0, 0.0, [joint.name]
    while joint.mimic is not None:
        factor, offset = joint.mimic.multiplier, joint.mimic.offset  # the standard's defaults are 1 and 0
        slope, shift = slope * (1.0 if factor is None else factor), shift + slope * (offset or 0.0)
        leader = joint.mimic.joint
        if leader not in joints or joints[leader].type == "fixed":
            raise InputError(f"{path}: joint {shown(joint.name)} mimics {shown(leader)}, which is no movable joint")
        if leader in followed:
            circle = " -> ".join(str(name)[:40] for name in [*followed[-3:], leader])
            raise InputError(f"{path}: mimic joints follow each other in a circle: {circle}")
        followed.append(leader)
        joint = joints[leader]
    return _Drive(joint.name, slope, shift)


def _tree(
    path: Path,
    robot: yourdfpy.Robot,
    movable: Sequence[Joint],
    above: Mapping[str, Joint],
    links: Sequence[str],
    carrying: Sequence[Joint],
) -> KinematicTree:
    by_name = {joint.name: joint for joint in robot.joints}
    drives = [_drive(path, joint, by_name) for joint in movable]
    still = {_drive(path, joint, by_name).leader for joint in carrying}
    everyone = list(dict.fromkeys(drive.leader for drive in drives))
    for name in everyone:
        check_joint(path, by_name[name])  # one may move none of the links itself
    leaders = [name for name in everyone if name not in still]
    index = {joint.name: k for k, joint in enumerate(movable)}
    frames = [z_frame(np.asarray(joint.axis)) for joint in movable]

    def place(link: str) -> tuple[int, np.ndarray]:
        """The movable joint above a link, and the link's frame in that joint's frame."""
        transform = np.eye(4)
        while link in above and above[link].type == "fixed":
            transform = _origin(above[link]) @ transform
            link = above[link].parent
        if link not in above:
            return BASE, transform
        joint = index[above[link].name]
        back = np.eye(4)
        back[:3, :3] = frames[joint].T
        return joint, back @ transform

    parents, rest = [], []
    for joint, frame in zip(movable, frames, strict=True):
        parent, transform = place(joint.parent)
        transform = transform @ _origin(joint)
        transform[:3, :3] = transform[:3, :3] @ frame
        parents.append(parent)
        rest.append(transform)
    points = [place(link) for link in links]
    found, overruled = _limits(path, movable, drives, everyone, by_name)
    ranges = dict(zip(everyone, found, strict=True))
    held = [d.slope * float(np.clip(0.0, *ranges[d.leader])) + d.shift for d in drives]
    free = [d.leader not in still for d in drives]
    return KinematicTree(
        rest_rotation=np.array([t[:3, :3] for t in rest], np.float32).reshape(-1, 3, 3),
        rest_position=np.array([t[:3, 3] for t in rest], np.float32).reshape(-1, 3),
        slope=np.array([d.slope if moves else 0.0 for d, moves in zip(drives, free, strict=True)], np.float32),
        shift=np.array([d.shift if moves else h for d, h, moves in zip(drives, held, free, strict=True)], np.float32),
        lower=np.array([ranges[name][0] for name in leaders], np.float32),
        upper=np.array([ranges[name][1] for name in leaders], np.float32),
        point_position=np.array([t[:3, 3] for _, t in points], np.float32),
        parents=tuple(parents),
        dofs=tuple(leaders.index(d.leader) if moves else HELD for d, moves in zip(drives, free, strict=True)),
        slides=tuple(joint.type == "prismatic" for joint in movable),
        point_joints=tuple(joint for joint, _ in points),
        dof_names=tuple(leaders),
        joint_names=tuple(joint.name for joint in movable),
        point_names=tuple(links),
        overruled=tuple(overruled),
    )


def _origin(joint: Joint) -> np.ndarray:
    return np.eye(4) if joint.origin is None else np.asarray(joint.origin, float)


def _limits(
    path: Path,
    movable: Sequence[Joint],
    drives: Sequence[_Drive],
    leaders: Sequence[str],
    joints: Mapping[str, Joint],
) -> tuple[list[tuple[float, float]], list[str]]:
    """The range of each degree of freedom in which all joints that it drives keep their limits.

    Also the mimic joints that would leave their leader one position: the SCHUNK hand's left URDF has one whose sign is
    the right hand's: a finger that stands still serves nobody, and their limits do not count.
    """
    ranges, overruled = [limits_of(joints[name]) for name in leaders], []
    for joint, drive in zip(movable, drives, strict=True):
        if drive.slope == 0:
            continue
        ends = sorted((np.array(limits_of(joint)) - drive.shift) / drive.slope)
        k = leaders.index(drive.leader)
        low, high = ranges[k]
        within = max(low, float(ends[0])), min(high, float(ends[1]))
        if within[0] > within[1] + 1e-6:
            raise InputError(
                f"{path}: the limits of {shown(drive.leader)} and its mimic joints exclude each other; fix the limits"
            )
        if within[1] - within[0] < _POINT <= min(high - low, ends[1] - ends[0]):
            overruled.append(joint.name)
        else:
            ranges[k] = within[0], max(within)
    return ranges, overruled
