"""Low-pass filtering of joint motions, as motion laboratories do before they differentiate or replay a recording."""

import numpy as np
from jaxtyping import Float
from scipy.signal import butter, sosfiltfilt

from mjx_hand.errors import InputError
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.pytree import replace

CUTOFF = 6.0  # Hz; deliberate hand movement lies below (Winter, Biomechanics and Motor Control of Human Movement)


def low_pass(motion: JointMotion, cutoff: float = CUTOFF) -> JointMotion:
    """Angles and wrist pose through a zero-phase fourth-order Butterworth filter (second order, forward and back).

    Quaternions are filtered by component, which is right where neighbours are close and of one sign, and normalised.

    Args:
        motion: gaps already interpolated.
        cutoff: Hz.

    Raises:
        InputError: the cut-off is not between 0 and half the frame rate.
    """
    check_cutoff(cutoff, motion.fps)
    quaternion = smooth_rows(motion.wrist_quaternion, motion.fps, cutoff)
    return replace(
        motion,
        angles=smooth_rows(motion.angles, motion.fps, cutoff),
        wrist_position=smooth_rows(motion.wrist_position, motion.fps, cutoff),
        wrist_quaternion=quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True),
    )


def check_cutoff(cutoff: float, fps: float) -> None:
    """Refuse what no low-pass filter of this frame rate can have.

    Raises:
        InputError: the cut-off (Hz) is not between 0 and half the frame rate.
    """
    if not 0 < cutoff < fps / 2:
        raise InputError(f"cut-off is {cutoff} Hz; for {fps:g} frames/s it must lie between 0 and half of that")


def smooth_rows(rows: Float[np.ndarray, "t n"], fps: float, cutoff: float) -> Float[np.ndarray, "t n"]:
    """Each column low-pass filtered along time, without delay."""
    sections = butter(2, cutoff, fs=fps, output="sos")
    # Short recordings: the filter's usual padding must stay shorter than the data.
    return sosfiltfilt(sections, rows, axis=0, padlen=min(15, len(rows) - 1))
