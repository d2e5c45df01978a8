"""What `mjx-hand build` takes from a person's recordings: hinge axes and the range of motion."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.motion import Motion
from mjx_hand.projection import fit_functional_axes, project
from mjx_hand.rigid.limits import limits_from_motion
from mjx_hand.rigid.rigid_hand import RigidHand, joint_rotations
from mjx_hand.rotations import geodesic_angle


def with_recorded_axes(rigid: RigidHand, recording: Path) -> tuple[RigidHand, str]:
    """The hand with axes fitted to a recording, and a line that says what they are worth on it.

    Raises:
        InputError: the file cannot be used, is of the other hand, or has too few valid frames.
    """
    motion = _motion_of(rigid, recording)
    fitted = fit_functional_axes(rigid, motion.rotations, motion.valid)
    frames = motion.rotations[motion.valid].astype(np.float32)
    before, after = (np.degrees(_errors(frames, hand)).mean() for hand in (rigid, fitted))
    gain = f"mean error on it {after:.2f} degrees, {before:.2f} with anatomical axes"
    return fitted, f"axes fitted to {recording}: {gain}"


def with_recorded_limits(rigid: RigidHand, recording: Path) -> tuple[RigidHand, str]:
    """The hand with a recording's range as its soft limits, and a line that says so.

    Raises:
        InputError: the file cannot be used, or is of the other hand.
    """
    motion = _motion_of(rigid, recording)
    frames = np.where(motion.valid[:, None, None, None], motion.rotations, np.eye(3)).astype(np.float32)
    limited = limits_from_motion(rigid, np.asarray(project(frames, rigid)), motion.valid)
    return limited, f"soft limits: the range of {recording}, 5 degrees more on each side, within the anatomical limits"


def _motion_of(rigid: RigidHand, recording: Path) -> Motion:
    motion = load_motion(recording)
    if motion.side != rigid.side:
        raise InputError(f"{recording}: a {motion.side} hand; --side {motion.side} fits it")
    return motion


def _errors(rotations: np.ndarray, rigid: RigidHand) -> np.ndarray:
    return np.asarray(geodesic_angle(jnp.asarray(rotations), joint_rotations(project(rotations, rigid), rigid)))
