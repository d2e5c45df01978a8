"""The keypoints of a rigid hand, as a tracker would see them."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.layouts import hand_keypoints
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics, tip_positions


def hinge_keypoints(
    angles: Float[np.ndarray, "t 20"],
    position: Float[np.ndarray, "t 3"],
    quaternion: Float[np.ndarray, "t 4"],
    rigid: RigidHand,
) -> Float[np.ndarray, "t 21 3"]:
    """The keypoints (m, world) of a rigid hand at hinge angles (rad) and wrist poses (m, wxyz)."""
    links = forward_kinematics(jnp.asarray(angles, jnp.float32), rigid)
    points = np.asarray(hand_keypoints(links[1], tip_positions(*links, rigid)), float)
    return np.einsum("tij,tkj->tki", quaternion_matrices(quaternion), points) + position[:, None]
