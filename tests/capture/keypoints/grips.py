"""Motions that the tests know the keypoints of: fingers closing and opening, each in its own rhythm, hinges alone."""

from functools import lru_cache

import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.capture.keypoints.layouts import hand_keypoints
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Motion
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand, joint_rotations

FPS, FRAMES = 50.0, 60
Array = np.ndarray


@lru_cache
def _rigid(side: str, shape: tuple[float, ...]) -> RigidHand:
    return build_rigid_hand(load_hand(side=side), np.array(shape))


def grip(side: str = "right", shape: Array | None = None, spread: float = 1.0) -> Motion:
    """A hand that closes and opens while its wrist turns; `spread` scales abduction."""
    shape = np.zeros(10) if shape is None else shape
    rigid = _rigid(side, tuple(shape.tolist()))
    time = np.arange(FRAMES) / FRAMES
    phase = np.arange(20)
    swing = 0.5 + 0.45 * np.sin(2 * np.pi * (time[:, None] + 0.13 * phase))
    lower, upper = np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper)
    angles = lower + (upper - lower) * swing
    angles[:, ::4] *= 0.6 * spread  # abduction: no finger passes through its neighbour
    turn = Rotation.from_rotvec(np.stack([0.6 * np.sin(6 * time), 0.4 * time, -0.8 * time], axis=1))
    return Motion(
        fps=FPS,
        rotations=np.asarray(joint_rotations(jnp.asarray(angles, jnp.float32), rigid), float),
        wrist_position=np.stack([0.1 * time, 0.3 + 0 * time, -0.2 * time], axis=1),
        wrist_quaternion=turn.as_quat(scalar_first=True),
        shape=shape,
        valid=np.ones(FRAMES, bool),
        side=side,
    )


def keypoints_of(motion: Motion) -> Array:
    """Its 21 keypoints (m), by a chain written out here: joint centres of the shape, one rotation after another."""
    hand = load_hand(side=motion.side)
    rest = np.asarray(hand.template, float) + np.asarray(hand.shapedirs, float) @ motion.shape
    centres = np.asarray(hand.joint_regressor, float) @ rest
    tips = rest[hand.tip_vertices]
    frames = motion.num_frames
    turn = {0: Rotation.from_quat(motion.wrist_quaternion, scalar_first=True).as_matrix()}
    joint = np.zeros((frames, 16, 3))
    joint[:, 0] = motion.wrist_position
    tip = np.zeros((frames, 5, 3))
    for finger in range(5):
        parent = 0
        for link in range(3 * finger + 1, 3 * finger + 4):
            joint[:, link] = joint[:, parent] + turn[parent] @ (centres[link] - centres[parent])
            turn[link] = turn[parent] @ motion.rotations[:, link - 1]
            parent = link
        tip[:, finger] = joint[:, parent] + turn[parent] @ (tips[finger] - centres[parent])
    return np.asarray(hand_keypoints(joint, tip), float)
