"""`Rollouts`: what a twin did, beside what the demonstrations asked; the input of every metric, plot and video."""

import numpy as np
from jaxtyping import Bool, Float, Int

from mjx_hand.pytree import pytree, static


@pytree
class Rollouts:
    """n rollouts of t control steps, padded to one length; metres, radians, seconds, quaternions wxyz, world frame.

    Frame 0 is the start; `counted` marks the demonstration's own frames, `held` those after its end, in which the last
    target is held on (all False where the rollouts were not continued).

    Attributes:
        demonstration: which demonstration each rollout followed.
        qpos: the scene's coordinates (the wrist's six, the hand's joints, the object's free joint).
        object_pose, object_reference: achieved and demonstrated.
        joints, joints_reference: joint centres, the wrist first.
        tips, tips_reference: finger tips.
        contact: how each link pressed the object in the step that led to each frame: force (N) on it, and where (m).
        least_force: least sum of such forces' magnitudes (N) that carries each rollout's object by upright faces.
        counted, held: frame masks.
        reward: of the step that led to each frame.
        fps: control rate.
    """

    demonstration: Int[np.ndarray, "n"]
    qpos: Float[np.ndarray, "n t nq"]
    object_pose: Float[np.ndarray, "n t 7"]
    object_reference: Float[np.ndarray, "n t 7"]
    joints: Float[np.ndarray, "n t links 3"]
    joints_reference: Float[np.ndarray, "n t links 3"]
    tips: Float[np.ndarray, "n t tips 3"]
    tips_reference: Float[np.ndarray, "n t tips 3"]
    contact: Float[np.ndarray, "n t touching 6"]
    least_force: Float[np.ndarray, "n"]
    counted: Bool[np.ndarray, "n t"]
    held: Bool[np.ndarray, "n t"]
    reward: Float[np.ndarray, "n t"]
    fps: float = static()
