"""`HandPose`: where a hand is and how it is bent, at one instant; and the way from one to another."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class HandPose:
    """A rigid hand's pose in the world (z up, the table at z = 0).

    Attributes:
        position, quaternion: of the wrist joint (m, wxyz).
        angles: of the hinges (rad).
    """

    position: Float[np.ndarray, "3"]
    quaternion: Float[np.ndarray, "4"]
    angles: Float[np.ndarray, "20"]


def way(start: HandPose, end: HandPose) -> Float[np.ndarray, "26"]:
    """The way from one pose to another: of the wrist (m), its turn (rad, in its axes at the start), and the hinges."""
    turn = np.zeros(3)
    mujoco.mju_subQuat(turn, end.quaternion, start.quaternion)
    return np.concatenate([end.position - start.position, turn, end.angles - start.angles])


def moved(pose: HandPose, step: Float[np.ndarray, "26"]) -> HandPose:
    """The pose at the end of a way of `way`."""
    quaternion = pose.quaternion.copy()
    mujoco.mju_quatIntegrate(quaternion, step[3:6], 1.0)
    return HandPose(pose.position + step[:3], quaternion / np.linalg.norm(quaternion), pose.angles + step[6:])
