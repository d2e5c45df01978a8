"""Simulated capture of keypoints: what a hand tracker would have reported of a known motion."""

import jax
import jax.numpy as jnp
import numpy as np

from mjx_hand.capture.keypoints.layouts import NUM_KEYPOINTS, hand_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.simulation.simulate import BURST, CHUNK, check_simulation, gap_bursts
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.skinning import skin
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.resample import quaternion_matrices, resample_motion

_skin = jax.jit(skin)


def simulate_keypoints(
    hand: HandModel,
    motion: Motion,
    seed: int,
    *,
    noise: float = 0.003,
    gap_fraction: float = 0.0,
    fps: float | None = None,
) -> KeypointRecording:
    """The 21 keypoints (`layouts.KEYPOINTS`) of a known motion of a known hand, as a tracker would report them.

    Args:
        hand: the hand that moves.
        motion: how it moves; frames that are not valid show no keypoint.
        seed: of all random draws; the same seed gives the same recording.
        noise: standard deviation of each coordinate in each frame, m; bone lengths then vary as real trackers' do.
        gap_fraction: mean share of frames in which a keypoint is missing, in bursts of several frames.
        fps: the tracker's rate; the motion's own if None.

    Raises:
        InputError: the motion is not for this hand, or an argument is out of range.
    """
    check_simulation(hand, motion, noise, gap_fraction, 0.0)
    if fps is not None and fps != motion.fps:
        motion = resample_motion(motion, fps)
    noising, hiding = np.random.default_rng(seed).spawn(2)
    shape = jnp.broadcast_to(jnp.asarray(motion.shape, jnp.float32), (CHUNK, len(motion.shape)))
    local = []
    for start in range(0, motion.num_frames, CHUNK):
        rotations = np.asarray(motion.rotations[start : start + CHUNK], np.float32)
        padding = np.broadcast_to(np.eye(3, dtype=np.float32), (CHUNK - len(rotations), 15, 3, 3))
        vertices, joints = _skin(hand, jnp.concatenate([rotations, padding]), shape)
        posed = hand_keypoints(joints, vertices[:, jnp.asarray(hand.tip_vertices)]) - joints[:, :1]
        local.append(np.asarray(posed, np.float64)[: len(rotations)])
    world = np.einsum("tab,tkb->tka", quaternion_matrices(motion.wrist_quaternion), np.concatenate(local))
    world += motion.wrist_position[:, None] + noising.normal(scale=noise, size=world.shape)
    hidden = gap_bursts(hiding, (motion.num_frames, NUM_KEYPOINTS), gap_fraction, BURST * motion.fps)
    hidden |= ~motion.valid[:, None]
    return KeypointRecording(
        fps=motion.fps,
        positions=np.where(hidden[..., None], np.nan, world),
        side=motion.side,
        source=f"simulated capture of {motion.source or 'a motion'}, seed {seed}",
    )
