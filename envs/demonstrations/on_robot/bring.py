"""`on_robot`: a person's demonstration as a robot's.

The object goes its way as demonstrated. A robot's hand is larger or smaller than a person's, has other fingers and
other knuckles: wrists cannot coincide, contacts can. First grasps are sought, by damped least squares from several
postures: each robot finger whose person's finger touches lies with its last link on the object at the same place, no
other link is inside the object, none in table or support, and the wrist is turned as the person's where that leaves a
choice. From a grasp that could hold the object the wrist then goes as the person's went, and fingers are where the
person's pads were, but off the object until they touch it. The best few grasps are rehearsed that way in simulation, up
to the first with which the object stays near its demonstrated way, and more of them where all lose or turn it; where it
stays near with none, the one that holds it longest and nearest is taken.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.on_robot.closure import closes
from envs.demonstrations.on_robot.follow import follow
from envs.demonstrations.on_robot.grasp import ALONG, Grasp, find_grasps
from envs.demonstrations.on_robot.left_out import NO_CLOSURE, OUT_OF_REACH, LeftOut
from envs.demonstrations.on_robot.robot_scene import RobotScene
from envs.demonstrations.on_robot.trial import Rehearsal, rehearse, slip
from envs.scene import NUM_WRIST
from mjx_hand.bodies.body import Body
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.pytree import replace
from mjx_hand.rigid.rigid_hand import RigidHand

_DEPTH = 0.004  # m that a link may be inside the object
_OFF = 0.004  # m that a finger may be off the surface where it should touch
_TOUCHES = 0.002  # m off the surface at which a link bears
_REHEARSED = 4  # grasps, and further ones until the object is neither lost nor turned
_NEAR_ENOUGH, _TURNED_LITTLE = 0.01, 0.25  # m, rad from the demonstrated pose, within which no better one is sought


@dataclass(frozen=True)
class Brought:
    """A robot's demonstration.

    Attributes:
        demonstration: with the robot's motion.
        fingers: of the robot that touch.
        grasp: how good the grasp is.
        rehearsal: how the object went with it.
    """

    demonstration: Demonstration
    fingers: tuple[str, ...]
    grasp: Grasp
    rehearsal: Rehearsal


def on_robot(demonstration: Demonstration, person: RigidHand, body: Body) -> Brought:
    """Bring a person's demonstration onto a robot hand.

    Raises:
        InputError, LeftOut: as `possible_grasps`.
    """
    scene, grasps = possible_grasps(demonstration, person, body)
    tried = []
    for grasp in sorted(grasps, key=lambda each: slip(scene, each.targets)):
        if len(tried) >= _REHEARSED and any(brought.rehearsal.held for brought in tried):
            break
        rows = follow(scene, grasp.targets)
        turn = Rotation.from_matrix(scene.base) * Rotation.from_euler("XYZ", rows[:, 3:NUM_WRIST])
        quaternion = turn.as_quat(scalar_first=True)
        made = moved_by(body, demonstration, rows[:, NUM_WRIST:], rows[:, :3] @ scene.base.T, quaternion)
        tried.append(Brought(made, scene.pads.fingers, grasp, rehearse(made, body)))
        if tried[-1].rehearsal.moved < _NEAR_ENOUGH and tried[-1].rehearsal.turned < _TURNED_LITTLE:
            break
    return max(tried, key=lambda brought: brought.rehearsal.score)


def possible_grasps(demonstration: Demonstration, person: RigidHand, body: Body) -> tuple[RobotScene, list[Grasp]]:
    """The grasps with which a robot could hold the object as a person does, and the scene that they are of.

    Raises:
        InputError: a hand of the other side.
        LeftOut: fewer than two of the fingers that touch, or no posture in which they do and hold the object.
    """
    if body.side != demonstration.motion.side:
        raise InputError(
            f"the demonstration is of a {demonstration.motion.side} hand, {body.name!r} is a {body.side} one; give a "
            f"{demonstration.motion.side} hand's description"
        )
    scene = RobotScene(demonstration, person, body)
    possible, faults = [], []
    for grasp in find_grasps(scene):
        fault = _fault(scene, grasp)
        if fault is None:
            possible.append(grasp)
        else:
            faults.append(fault)
    if not possible:
        raise faults[0]
    return scene, possible


def moved_by(
    body: Body,
    demonstration: Demonstration,
    angles: Float[np.ndarray, "t j"],
    wrist_position: Float[np.ndarray, "t 3"],
    wrist_quaternion: Float[np.ndarray, "t 4"],
) -> Demonstration:
    """The demonstration with a robot's joints (rad, m) and wrist poses (m, wxyz) in the place of the person's."""
    motion = JointMotion(
        fps=demonstration.motion.fps,
        angles=angles,
        wrist_position=wrist_position,
        wrist_quaternion=wrist_quaternion,
        valid=np.ones(len(angles), bool),
        side=body.side,
        source=f"{demonstration.motion.source} on {body.name}",
        joint_names=body.joints,
    )
    return replace(demonstration, motion=motion, tracked=None)  # a tracker saw the person's hand


def _fault(scene: RobotScene, grasp: Grasp) -> LeftOut | None:
    """Why a grasp does not touch where the person's does, or could not hold the object."""
    fingers = scene.pads.fingers
    name = f"{scene.body.name!r} cannot grasp as demonstrated ({scene.demonstration.grasp})"
    if grasp.sunk > _DEPTH:
        return LeftOut(OUT_OF_REACH, f"{name}: its links are {1e3 * grasp.sunk:.0f} mm inside table or support")
    far = not scene.pads.wraps and (grasp.off.max() > 2 * ALONG + _OFF or grasp.gap.max() > _OFF)
    if far or grasp.depth > _DEPTH:
        return LeftOut(
            OUT_OF_REACH,
            f"{name}: its {fingers[int(grasp.off.argmax())]} stays {1e3 * grasp.off.max():.0f} mm from where the "
            f"person's touches, its links are {1e3 * grasp.depth:.0f} mm inside",
        )
    scene.place(grasp.targets, scene.pads.grasp)
    contacts = [(point, way) for gap, point, way in scene.near().values() if gap < _TOUCHES]
    points, ways = (np.array([contact[k] for contact in contacts]).reshape(-1, 3) for k in (0, 1))
    if closes(points, ways, scene.demonstration.object.friction):
        return None
    return LeftOut(NO_CLOSURE, f"{name}: no posture of it has force closure, in the best {len(points)} links touch")
