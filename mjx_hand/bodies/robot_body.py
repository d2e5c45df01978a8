"""A robot hand's description and URDF as a `Body`."""

import functools
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float

from mjx_hand.bodies.body import Body, ContactGeom, Coupling
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS
from mjx_hand.rigid.gains import Gains
from mjx_hand.robots.hand_axes import check_directions, hand_axes
from mjx_hand.robots.model.gains import ruled_gains
from mjx_hand.robots.model.links import HandLinks, hand_links
from mjx_hand.robots.model.shapes import AbsentMeshError
from mjx_hand.robots.model.spec import WRIST, RobotModel, add_actuators, bare_spec, geom_name, model_links
from mjx_hand.robots.robot_hand import RobotHand, load_robot, urdf_of


def robot_body(
    robot: str | Path | RobotHand, urdf: str | Path | None = None, *, collision: str = "hulls", absent: str = "refuse"
) -> Body:
    """A robot hand, from its description.

    Args:
        robot: a description, its name among `known_robots()`, or the path of its file.
        urdf: its URDF with meshes; None for the one that the description names.
        collision: "hulls" for the URDF's own collision shapes, meshes by their convex hulls, or "capsules".
        absent: "refuse" a URDF whose meshes are not there, or put "bones" in their place: see `model_links`.

    Raises:
        InputError: description or URDF cannot be used: see `load_robot`, `hand_links`, `model_links`; directions that
            are not the links'; or no joint that an actuator could move.
    """
    description = robot if isinstance(robot, RobotHand) else load_robot(robot)
    file = urdf_of(description, urdf)
    return body_of_model(description, *robot_model(description, file, collision, absent))


def robot_model(
    description: RobotHand, urdf: Path, collision: str = "hulls", absent: str = "refuse"
) -> tuple[RobotModel, str]:
    """What the hand's spec is made of, and its side; see `robot_body`."""
    hand = hand_links(description, urdf)
    side = _side(description, urdf)
    tips = {_finger(keypoint): link for link, keypoint in description.tips.items()}
    try:
        links = model_links(hand, collision, absent)
    except AbsentMeshError as error:
        place = description.place  # of a file that the caller gave it says nothing
        raise InputError(f"{error}{place.others() if place and urdf == place.path else ''}") from None
    robot = RobotModel(
        name=description.name,
        links=links,
        mount=_mount(description, hand, side),
        tips={finger: tips[finger] for finger in FINGERS if finger in tips},
        notes=hand.notes,
    )
    return robot, side


def body_of_model(description: RobotHand, robot: RobotModel, side: str) -> Body:
    """The body of a hand whose links are read."""
    moving = [each.link.hinge for each in robot.links if each.link.hinge is not None]
    led = [hinge for hinge in moving if hinge.mimic is None]
    joints = tuple(hinge.name for hinge in led)
    if not joints:
        raise InputError(f"{robot.name}: no joint that an actuator could move; give a hand whose fingers move")
    of_finger = _fingers(robot)
    if not any(each.touching and of_finger[each.body] for each in robot.links):
        raise InputError(f"{robot.name}: no finger has a shape that could touch; give its links <collision>")
    for name, given in (("force_limits", description.force_limits), ("stiffness", description.stiffness)):
        if unknown := [joint for joint in given if joint not in joints]:
            raise InputError(f"{robot.name}: {name} names {unknown[0]!r}; its actuated joints: {', '.join(joints)}")
    usual = Gains()
    bare = bare_spec(robot, usual.armature, usual.wrist_armature, visual=False).compile()
    gains = ruled_gains(bare, joints, [hinge.effort for hinge in led], description.force_limits, description.stiffness)
    fingers = tuple(robot.tips)
    links = [WRIST, *(each.body for each in robot.links if each.link.hinge is not None)]
    knuckles = [next(b for b in links if of_finger[b] == finger) for finger in fingers if finger != "thumb"]
    ends = (knuckles[0], knuckles[-1]) if len(knuckles) > 1 else (knuckles[0], _first(of_finger, links, "thumb"))

    @functools.lru_cache(maxsize=4)
    def made(visual: bool) -> mujoco.MjSpec:
        return bare_spec(robot, usual.armature, usual.wrist_armature, visual)

    def build(gains: Gains, visual: bool) -> mujoco.MjSpec:
        spec = made(visual).copy()
        add_actuators(spec, joints, gains)
        return spec

    return Body(
        name=robot.name,
        side=side,
        fingers=fingers,
        opposing=("thumb",),
        joints=joints,
        coupled=tuple(Coupling(hinge.name, *hinge.mimic) for hinge in moving if hinge.mimic is not None),
        tree_joints=tuple(hinge.name for hinge in moving),
        links=tuple(links),
        palm=(0, links.index(ends[0]), links.index(ends[1])),
        contacts=tuple(
            ContactGeom(geom_name(each.body, k), each.body, of_finger[each.body])
            for each in robot.links
            for k in range(len(each.touching))
        ),
        gains=gains,
        build=build,
    )


def _side(description: RobotHand, urdf: Path) -> str:
    """Which hand the robot is, as its links tell; a right one where they do not.

    Raises:
        InputError: the description's directions are not the links'.
    """
    found = hand_axes(description, urdf)
    check_directions(description, urdf, found)
    return found.side or "right"


def _finger(keypoint: str) -> str:
    """The finger of a keypoint; the little one is called pinky in MANO's order."""
    name = keypoint.partition("_")[0]
    return "pinky" if name == "little" else name


def _first(of_finger: dict[str, str], links: list[str], finger: str) -> str:
    return next(link for link in links if of_finger[link] == finger)


def _fingers(robot: RobotModel) -> dict[str, str]:
    """The finger that each body belongs to: the one whose tip it moves alone; "" of those that move several or none."""
    bodies, parents = robot.bodies(), {each.link.name: each.link.parent for each in robot.links}
    moves = {each.link.name: each.link.hinge is not None for each in robot.links}
    carried: dict[str, set[str]] = {name: set() for name in parents}
    for finger, link in robot.tips.items():
        while link:
            carried[link].add(finger)
            link = parents[link]
    found = {WRIST: ""}
    for name, parent in parents.items():
        above = found[bodies[parent]] if parent else ""
        own = next(iter(carried[name])) if len(carried[name]) == 1 else ""
        found[bodies[name]] = above or (own if moves[name] else "")
    return found


def _mount(description: RobotHand, hand: HandLinks, side: str) -> Float[np.ndarray, "4 4"]:
    """wrist_from_root: the palm's link at the wrist, fingers along -x (of a left hand +x), the palm towards -y."""
    robot = np.stack([description.fingers, description.palmar, np.cross(description.fingers, description.palmar)], 1)
    along = -1.0 if side == "right" else 1.0
    human = np.array([[along, 0, 0], [0, -1, 0], [0, 0, -along]]).T
    mount = np.eye(4)
    mount[:3, :3] = human @ (hand.directions @ robot).T
    mount[:3, 3] = -mount[:3, :3] @ hand.palm[:3, 3]
    return mount
