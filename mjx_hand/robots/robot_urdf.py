"""A robot hand's `KinematicTree` from its URDF (https://wiki.ros.org/urdf/XML), read with yourdfpy.

Only joints between the root and the links asked for are kept: the others cannot move them.
"""

import contextlib
import logging
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yourdfpy
from yourdfpy.urdf import Joint

from mjx_hand.errors import InputError
from mjx_hand.files.input_file import refuse_pointer
from mjx_hand.robots.solver.kinematic_tree import BASE, KinematicTree, z_frame

_MOVABLE = ("revolute", "continuous", "prismatic")


def robot_tree(path: str | Path, links: Sequence[str]) -> KinematicTree:
    """The joints that move `links`, and the links' origins as points, in the frame of the URDF's root link.

    A mimic joint follows the joint that it names, through others if need be. A degree of freedom's limits are those of
    all joints that it drives.

    Raises:
        InputError: no such file, not a URDF, a link that it does not have, links that nothing moves, a joint of an
            unknown type or without limits, mimic joints that follow each other or none, limits that exclude each other.
    """
    path = Path(path)
    robot = _read(path)
    names = [link.name for link in robot.links]
    if missing := [link for link in links if link not in names]:
        raise InputError(f"{path}: has no link {missing[0]!r}; its links: {', '.join(names)}")
    above = {joint.child: joint for joint in robot.joints}
    order: list[Joint] = []
    for link in links:
        known = {joint.name for joint in order}
        order += [joint for joint in _chain(path, link, above) if joint.name not in known]
    for joint in order:
        _check_joint(path, joint)
    movable = [joint for joint in order if joint.type != "fixed"]
    if not movable:
        raise InputError(f"{path}: no movable joint moves {', '.join(links)}; name the links of fingers that move")
    return _tree(path, robot, movable, above, links)


def _read(path: Path) -> yourdfpy.Robot:
    if not path.is_file():
        raise InputError(f"{path}: {'a folder' if path.is_dir() else 'no such file'}; give the path of a URDF")
    refuse_pointer(path)
    try:
        ElementTree.parse(path)  # yourdfpy takes what it can of a file that is cut short
        with _quiet("yourdfpy.urdf"):
            model = yourdfpy.URDF.load(str(path), build_scene_graph=False, load_meshes=False)
    except Exception as error:  # yourdfpy passes on whatever XML and number parsing raise
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{path}: not a URDF that can be read ({reason})") from None
    if not model.robot.links:
        raise InputError(f"{path}: not a URDF: it has no links")
    return model.robot


@contextlib.contextmanager
def _quiet(logger: str) -> Iterator[None]:
    # yourdfpy logs an error for every mesh that is not beside the file; kinematics need none.
    log = logging.getLogger(logger)
    before = log.disabled
    log.disabled = True
    try:
        yield
    finally:
        log.disabled = before


def _chain(path: Path, link: str, above: Mapping[str, Joint]) -> list[Joint]:
    """The joints from the root to `link`."""
    chain: list[Joint] = []
    while link in above:
        joint = above[link]
        if joint.name in {below.name for below in chain}:
            raise InputError(f"{path}: joint {joint.name!r} is above itself; a URDF's links must form a tree")
        chain.insert(0, joint)
        link = joint.parent
    return chain


def _check_joint(path: Path, joint: Joint) -> None:
    if joint.type not in ("fixed", *_MOVABLE):
        raise InputError(f"{path}: joint {joint.name!r} is of type {joint.type!r}; valid: fixed, {', '.join(_MOVABLE)}")
    if joint.type in ("revolute", "prismatic"):
        limit = joint.limit
        if limit is None or limit.lower is None or limit.upper is None:
            raise InputError(f"{path}: joint {joint.name!r} has no limits; add <limit lower=... upper=...>")
        if not limit.lower <= limit.upper:
            ends = f"from {limit.lower} to {limit.upper}"
            raise InputError(f"{path}: joint {joint.name!r} has limits {ends}; give the lower one first")
    if joint.type != "fixed" and not (np.isfinite(joint.axis).all() and np.linalg.norm(joint.axis) > 1e-9):
        raise InputError(f"{path}: joint {joint.name!r} has axis {joint.axis}; give a direction")


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
            raise InputError(f"{path}: joint {joint.name!r} mimics {leader!r}, which is no movable joint of it")
        if leader in followed:
            raise InputError(f"{path}: mimic joints follow each other in a circle: {' -> '.join([*followed, leader])}")
        followed.append(leader)
        joint = joints[leader]
    return _Drive(joint.name, slope, shift)


def _tree(
    path: Path,
    robot: yourdfpy.Robot,
    movable: Sequence[Joint],
    above: Mapping[str, Joint],
    links: Sequence[str],
) -> KinematicTree:
    by_name = {joint.name: joint for joint in robot.joints}
    drives = [_drive(path, joint, by_name) for joint in movable]
    leaders = list(dict.fromkeys(drive.leader for drive in drives))
    for name in leaders:
        _check_joint(path, by_name[name])  # one may move none of the links itself
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
    lower, upper = _limits(path, movable, drives, leaders, by_name)
    return KinematicTree(
        rest_rotation=np.array([t[:3, :3] for t in rest], np.float32),
        rest_position=np.array([t[:3, 3] for t in rest], np.float32),
        slope=np.array([d.slope for d in drives], np.float32),
        shift=np.array([d.shift for d in drives], np.float32),
        lower=lower,
        upper=upper,
        point_position=np.array([t[:3, 3] for _, t in points], np.float32),
        parents=tuple(parents),
        dofs=tuple(leaders.index(d.leader) for d in drives),
        slides=tuple(joint.type == "prismatic" for joint in movable),
        point_joints=tuple(joint for joint, _ in points),
        dof_names=tuple(leaders),
        joint_names=tuple(joint.name for joint in movable),
        point_names=tuple(links),
    )


def _origin(joint: Joint) -> np.ndarray:
    return np.eye(4) if joint.origin is None else np.asarray(joint.origin, float)


def _limits(
    path: Path,
    movable: Sequence[Joint],
    drives: Sequence[_Drive],
    leaders: Sequence[str],
    joints: Mapping[str, Joint],
) -> tuple[np.ndarray, np.ndarray]:
    """The range of each degree of freedom in which all joints that it drives keep their limits."""
    lower, upper = np.full(len(leaders), -np.inf), np.full(len(leaders), np.inf)
    driven = [*zip(movable, drives, strict=True), *((joints[name], _Drive(name, 1.0, 0.0)) for name in leaders)]
    for joint, drive in driven:
        if joint.type == "continuous" or joint.limit is None or drive.slope == 0:
            continue
        ends = sorted((np.array([joint.limit.lower, joint.limit.upper]) - drive.shift) / drive.slope)
        k = leaders.index(drive.leader)
        lower[k], upper[k] = max(lower[k], ends[0]), min(upper[k], ends[1])
    for name, low, high in zip(leaders, lower, upper, strict=True):
        if low > high + 1e-6:
            raise InputError(f"{path}: the limits of {name!r} and its mimic joints exclude each other; fix the limits")
    return lower.astype(np.float32), np.maximum(upper, lower).astype(np.float32)
