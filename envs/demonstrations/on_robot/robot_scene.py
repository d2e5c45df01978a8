"""`RobotScene`: a robot hand and a demonstration's object, and what is asked of them."""

import dataclasses
import functools

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.on_robot.left_out import shared_pads
from envs.demonstrations.on_robot.pads import demonstrated_pads
from envs.demonstrations.on_robot.sticking import opposed
from envs.model_grip import ANYWHERE, Touch
from envs.physics.solver import gauss_seidel
from envs.scene import base_rotation, demonstration_spec, wrist_coordinates
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.coordinates import coordinates_per_target, hand_coordinates
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.rigid_hand import RigidHand

CLEAR = 0.001  # m off the object, beyond which a link that does not touch is not inside
OFF_GROUND = 0.003  # m that links keep off table and support


class RobotScene:
    """One demonstration on its way onto a robot.

    Attributes:
        pads: where the person's fingers touch, of those that the robot has.
        base: turn of the wrist's slides.
        wrist: the person's wrist in them, frame by frame.
        touch: links and object.
        low, high, middle: limits of the targets (wrist and actuated joints), and what lies between them.
        last: each finger's last link, "" the palm's, by its number in `touch`.
        sites: the finger tips'.
    """

    def __init__(self, demonstration: Demonstration, person: RigidHand, body: Body):
        self.demonstration, self.body = demonstration, body
        pads = shared_pads(demonstrated_pads(demonstration, person), body)
        sides = np.isin(pads.fingers, body.opposing)
        touching = opposed(pads.touching, sides, demonstration.object_pose[:, :3], pads.in_air)
        self.pads = dataclasses.replace(pads, touching=touching)
        self.base = base_rotation(demonstration)
        motion = demonstration.motion
        self.wrist = wrist_coordinates(motion.wrist_position, motion.wrist_quaternion, self.base)
        self.model = demonstration_spec(demonstration, body).compile()
        self.touch = Touch(self.model, body, palm=True)
        self.count = body.num_targets
        self.mix = coordinates_per_target(self.model, self.count)
        self.low, self.high = self.model.actuator_ctrlrange[: self.count].T
        self.middle = (self.low + self.high) / 2
        self.last = {finger: k for k, finger in enumerate(self.touch.fingers)}  # each finger's last link
        ground = self.touch.ground
        self.model.geom_sameframe[ground] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # or their places are not read
        self._ground = self.model.geom_pos[ground].copy(), self.model.geom_quat[ground].copy()
        self.sites = {finger: self.model.site(f"{finger}_tip").id for finger in body.fingers}

    @functools.cached_property
    def trial_model(self) -> mujoco.MjModel:
        """For simulations of grasps in the air: the hand meets the object and itself. Made when asked for."""
        (model,) = gauss_seidel([demonstration_spec(self.demonstration, self.body, contacts="self").compile()])
        return model

    def place(self, targets: np.ndarray, frame: int) -> None:
        """Put hand and object where they are in a frame with these targets."""
        self.touch.place(hand_coordinates(self.model, targets), self.demonstration.object_pose[frame])

    def put_ground(self, frame: int) -> None:
        """Put table and support where they are to the object of this frame as they are to it at the beginning.

        A grasp is sought where the object is carried, and has to be one that picks it up. Frame 0 puts them
        back.
        """
        place, turn = self._ground
        start, there = self.demonstration.object_pose[0], self.demonstration.object_pose[frame]
        first, last = (Rotation.from_quat(pose[3:], scalar_first=True) for pose in (start, there))
        moved = last * first.inv()
        ground = self.touch.ground
        self.model.geom_pos[ground] = there[:3] + moved.apply(place - start[:3])
        turned = moved * Rotation.from_quat(turn, scalar_first=True)
        self.model.geom_quat[ground] = turned.as_quat(scalar_first=True)

    def off_ground(self, weight: float) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Residuals of links nearer to the ground than they should be, where `weight` (m) is 1, and their slopes."""
        near = list(self.touch.nearest(OFF_GROUND, self.touch.ground))
        values = [np.array([(OFF_GROUND - gap) / weight]) for _, gap, _, _ in near]
        return values, [(way @ self.jacobian(link, point))[None] / weight for link, _, point, way in near]

    def near(self) -> dict[int, tuple[float, np.ndarray, np.ndarray]]:
        """Of every link its gap, its point nearest to the object, and the way in, where they are now."""
        return {number: (gap, point, way) for number, gap, point, way in self.touch.nearest(ANYWHERE)}

    def jacobian(self, link: int, point: np.ndarray) -> Float[np.ndarray, "3 u"]:
        """How a point (m, world) of a link moves with the targets."""
        return self.touch.jacobian(link, point) @ self.mix
