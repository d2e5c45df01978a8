"""The links of a robot hand from its URDF: those that its palm carries, with their joints, inertias and shapes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yourdfpy
from jaxtyping import Float
from yourdfpy.urdf import Joint

from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import shown
from mjx_hand.robots.robot_file import read_robot
from mjx_hand.robots.robot_hand import RobotHand
from mjx_hand.robots.robot_urdf import robot_tree
from mjx_hand.robots.urdf_file import check_joint, limits_of

_REACH = (0.03, 0.6)  # m from the palm to a finger tip
_MOST_OTHERS = 2  # fingers that a description may leave out


@dataclass(frozen=True)
class Hinge:
    """How a link moves: about (or along) an axis of its own frame; limits and effort rad, N m (m, N)."""

    name: str
    axis: Float[np.ndarray, "3"]
    slides: bool
    limits: tuple[float, float]
    effort: float | None
    mimic: tuple[str, float, float] | None  # leader, slope, shift


@dataclass(frozen=True)
class Link:
    """A link: where it is in its parent's frame, with its joint at zero.

    Attributes:
        name: the URDF's.
        parent: its parent's name, "" of the hand's root.
        place: parent_from_link, 4 x 4 (m).
        hinge: how it moves; None where it is fixed to its parent.
        source: what the URDF says of its mass and shapes.
    """

    name: str
    parent: str
    place: Float[np.ndarray, "4 4"]
    hinge: Hinge | None
    source: yourdfpy.Link


@dataclass(frozen=True)
class HandLinks:
    """A hand's links, parents first.

    Attributes:
        path: of the URDF.
        links: from the link that the palm is fixed to, outwards.
        palm: place of the palm's link in the first one's frame.
        directions: turn from the URDF's root frame, in which a description has its directions, to the first link's.
        notes: what was left out, one line each.
    """

    path: Path
    links: tuple[Link, ...]
    palm: Float[np.ndarray, "4 4"]
    directions: Float[np.ndarray, "3 3"]
    notes: tuple[str, ...] = field(default=())


def hand_links(description: RobotHand, path: str | Path) -> HandLinks:
    """The links of the hand that a description names, in a URDF that may hold an arm too.

    Raises:
        InputError: as `robot_tree`; links that form no tree; a palm that does not carry the finger tips; a size that no
            hand has; fingers of a second hand.
    """
    path = Path(path)
    robot = read_robot(path)
    above = _tree(path, robot)
    tree = robot_tree(path, list(description.tips), description.palm)  # refuses links and joints that cannot be
    ranges = dict(zip(tree.dof_names, zip(tree.lower.tolist(), tree.upper.tolist(), strict=True), strict=True))
    up = _upwards(description.palm, above)
    root, carried = description.palm, []
    for joint in up:
        if joint.type != "fixed":
            carried.append(joint.name)
        elif not carried:
            root = joint.parent
    below = _below(root, robot.joints)
    for tip in description.tips:
        if tip not in below:
            raise InputError(
                f"{path}: palm {shown(description.palm)} does not carry the finger tip {shown(tip)}; name as palm the "
                "link that the fingers hang on"
            )
    sources = {link.name: link for link in robot.links}
    links = [Link(root, "", np.eye(4), None, sources[root])]
    inside = {above[name].name: above[name] for name in below[1:]}
    for name in below[1:]:
        joint = above[name]
        check_joint(path, joint)
        hinge = None if joint.type == "fixed" else _hinge(path, joint, inside, ranges)
        links.append(Link(name, joint.parent, _origin(joint), hinge, sources[name]))
    places = places_of(links)
    _check_size(path, description, places)
    _check_others(path, description, links)
    directions = np.eye(3)
    for joint in _upwards(root, above)[::-1]:
        directions = _origin(joint)[:3, :3].T @ directions if joint.type == "fixed" else _turned(joint, directions)
    notes = []
    if carried:
        outside = [name for name in sources if name not in below]
        notes.append(
            f"{', '.join(carried[::-1])} and {len(outside)} links above the palm are left out: the floating wrist "
            "takes their place"
        )
    return HandLinks(path, tuple(links), places[description.palm], directions, tuple(notes))


def places_of(links: Sequence[Link]) -> dict[str, Float[np.ndarray, "4 4"]]:
    """root_from_link of each link, with all joints at zero."""
    places: dict[str, np.ndarray] = {}
    for link in links:
        places[link.name] = places[link.parent] @ link.place if link.parent else link.place
    return places


def _tree(path: Path, robot: yourdfpy.Robot) -> dict[str, Joint]:
    """The joint above each link.

    Raises:
        InputError: a link that two joints carry, joints in a circle, or several roots.
    """
    above: dict[str, Joint] = {}
    names = {link.name for link in robot.links}
    for joint in robot.joints:
        for end in (joint.parent, joint.child):
            if end not in names:
                raise InputError(f"{path}: joint {shown(joint.name)} names link {shown(end)}, which is not there")
        if joint.child in above:
            raise InputError(
                f"{path}: link {shown(joint.child)} hangs on two joints, {shown(above[joint.child].name)} and "
                f"{shown(joint.name)}; loops are not supported: cut one of them"
            )
        above[joint.child] = joint
    roots = [link.name for link in robot.links if link.name not in above]
    if len(roots) != 1:
        said = ", ".join(shown(root) for root in roots[:4]) if roots else "none: its joints form a loop"
        raise InputError(f"{path}: a robot has one root link, this has {said}; give a file of one hand")
    for name in above:
        _upwards(name, above)
    return above


def _upwards(link: str, above: dict[str, Joint]) -> list[Joint]:
    """The joints from a link to the root, the nearest first."""
    chain: list[Joint] = []
    while link in above:
        chain.append(above[link])
        if len(chain) > len(above):
            raise InputError(f"joint {shown(chain[-1].name)} is above itself; a URDF's links must form a tree")
        link = above[link].parent
    return chain


def _below(root: str, joints: Sequence[Joint]) -> list[str]:
    """A link and all that it carries, each link before what it carries, branch after branch."""
    found = [root]
    for joint in joints:
        if joint.parent == root:
            found += _below(joint.child, joints)
    return found


def _origin(joint: Joint) -> Float[np.ndarray, "4 4"]:
    return np.eye(4) if joint.origin is None else np.asarray(joint.origin, float)


def _turned(joint: Joint, directions: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """Directions below a joint that stands still at zero, or as near to it as its limits allow."""
    value = float(np.clip(0.0, *limits_of(joint)))
    turn = np.eye(3)
    if joint.type != "prismatic" and value:
        axis = np.asarray(joint.axis, float) / np.linalg.norm(joint.axis)
        cross = np.cross(np.eye(3), axis)
        turn = np.eye(3) + np.sin(value) * cross + (1 - np.cos(value)) * cross @ cross
    return turn.T @ _origin(joint)[:3, :3].T @ directions


def _hinge(path: Path, joint: Joint, inside: Mapping[str, Joint], ranges: Mapping[str, tuple[float, float]]) -> Hinge:
    """How a joint moves; a mimic joint by the joint that leads it in the end."""
    slope, shift, leader = 1.0, 0.0, joint
    for _ in inside:
        if leader.mimic is None:
            break
        factor = 1.0 if leader.mimic.multiplier is None else float(leader.mimic.multiplier)
        slope, shift = slope * factor, shift + slope * float(leader.mimic.offset or 0.0)
        following = inside.get(leader.mimic.joint)
        if following is None or following.type == "fixed":
            raise InputError(
                f"{path}: joint {shown(leader.name)} mimics {shown(leader.mimic.joint)}, which moves nothing here"
            )
        leader = following
    if leader.mimic is not None:
        raise InputError(f"{path}: joint {shown(joint.name)} mimics in a circle; one of them must lead")
    axis = np.asarray(joint.axis, float)
    effort = None if joint.limit is None or joint.limit.effort is None else float(joint.limit.effort)
    low, high = ranges.get(joint.name, limits_of(joint))  # those within which tied joints keep theirs, too
    return Hinge(
        name=joint.name,
        axis=axis / np.linalg.norm(axis),
        slides=joint.type == "prismatic",
        limits=(max(low, -2 * np.pi), min(high, 2 * np.pi)),  # MuJoCo's actuators want a range
        effort=effort if effort and effort > 0 else None,
        mimic=None if leader is joint else (leader.name, slope, shift),
    )


def _check_size(path: Path, description: RobotHand, places: dict[str, np.ndarray]) -> None:
    reach = max(np.linalg.norm(places[tip][:3, 3] - places[description.palm][:3, 3]) for tip in description.tips)
    if not _REACH[0] <= reach <= _REACH[1]:
        units = {"centimetres": 100, "millimetres": 1000}
        hint = next((unit for unit, by in units.items() if _REACH[0] <= reach / by <= _REACH[1]), "")
        guess = f" (is it in {hint}?)" if hint else ""
        raise InputError(
            f"{path}: a finger tip is {reach:.3g} m from the palm, of a hand {_REACH[0]:g} to {_REACH[1]:g} m{guess}; "
            "give a URDF in metres"
        )


def _check_others(path: Path, description: RobotHand, links: Sequence[Link]) -> None:
    """Refuse a file with many fingers that the description does not name: those of a second hand."""
    branch: dict[str, str] = {}  # of each link, the first moving link that carries it
    for link in links:
        branch[link.name] = branch.get(link.parent, "") or (link.name if link.hinge is not None else "")
    named = {branch[tip] for tip in description.tips}
    others = sorted({name for name in branch.values() if name and name not in named})
    if len(others) > _MOST_OTHERS:
        raise InputError(
            f"{path}: {len(others)} more fingers than the description names ({', '.join(map(shown, others[:3]))}, …), "
            "as of two hands; name them all, or give a file of one hand"
        )
