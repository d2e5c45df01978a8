"""How hard a hand must press to carry an object that no grasp type says anything about, and from when on."""

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.scene import OBJECT
from mjx_hand.motion.demonstration import Demonstration

RECORDED = "recorded"  # what a demonstration that is of no grasp type calls its grasp
GRIP_RAMP = 0.3  # s before an object first moves, in which the grip of a recorded hand, or a robot's, sets in
_GRAVITY = 9.81
_MOVED, _TURNED = 0.002, np.deg2rad(2.0)  # m, rad from its first pose


def grip_force_of(mass: float, friction: float, share: float = 1.0) -> float:
    """The force (N) of a thumb against the fingers with which friction carries `2 share` times the object's weight.

    Both sides of a grip bear: 2 F μ = m g would just hold.
    """
    return share * mass * _GRAVITY / friction


def least_contact_force(model: mujoco.MjModel) -> float:
    """The least sum of contact forces' magnitudes (N) that carries a scene's object by its upright faces.

    A contact's normal force N bears μ N, so that all together need N = m g / μ, of the magnitude N sqrt(1 + μ²).
    """
    friction = model.geom_friction[model.geom_bodyid == model.body(OBJECT).id, 0].max()
    return float(model.body(OBJECT).mass[0] * _GRAVITY * np.hypot(1.0, friction) / friction)


def closing_ramp(demonstration: Demonstration, frames: int, seconds: float) -> Float[np.ndarray, "{frames}"]:
    """From 0 to 1 in these seconds before the object first moves, and 1 from then on."""
    pose = demonstration.object_pose
    turned = Rotation.from_quat(pose[:, 3:], scalar_first=True)
    away = np.linalg.norm(pose[:, :3] - pose[0, :3], axis=1) > _MOVED
    moves = away | ((turned * turned[0].inv()).magnitude() > _TURNED)
    first = int(np.argmax(moves)) if moves.any() else len(pose)
    length = max(round(seconds * demonstration.motion.fps), 1)
    return np.clip((np.arange(frames) - (first - length)) / length, 0.0, 1.0)
