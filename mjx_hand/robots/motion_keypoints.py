"""The 21 keypoints of a recorded motion, so that rotations can be followed as keypoints are."""

import jax.numpy as jnp
import numpy as np

from mjx_hand.capture.keypoints.layouts import hand_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.motion import Motion
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.rigid.rigid_hand import RigidHand, chain, tip_positions


def motion_keypoints(motion: Motion, rigid: RigidHand) -> KeypointRecording:
    """Joint centres and finger tips (m) in the recording's world; NaN in its gaps.

    Args:
        motion: the recording.
        rigid: the person's hand, of `sequence.rigid_hand_of`.
    """
    rotations = jnp.asarray(np.where(motion.valid[:, None, None, None], motion.rotations, np.eye(3)), jnp.float32)
    links = chain(rotations, jnp.asarray(rigid.link_offset))
    points = np.asarray(hand_keypoints(links[1], tip_positions(*links, rigid)), float)
    quaternion = np.where(motion.valid[:, None], motion.wrist_quaternion, [1.0, 0.0, 0.0, 0.0])
    world = np.einsum("tij,tkj->tki", quaternion_matrices(quaternion), points) + motion.wrist_position[:, None]
    return KeypointRecording(
        fps=motion.fps,
        positions=np.where(motion.valid[:, None, None], world, np.nan),
        side=motion.side,
        source=motion.source,
        warnings=motion.warnings,
    )
