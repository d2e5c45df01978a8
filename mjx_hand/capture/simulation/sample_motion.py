"""`sample_motion`: a hand motion without a recording, for examples, tests and first steps."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

from mjx_hand.capture.simulation.off_axis import add_off_axis_rotation
from mjx_hand.errors import InputError
from mjx_hand.hand.model import HandModel
from mjx_hand.motion.motion import Motion
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.postures import postures
from mjx_hand.rigid.rigid_hand import joint_rotations

SEQUENCE = ("flat", "fist", "flat", "pinch", "spread", "flat")  # the postures, at equal intervals


def sample_motion(
    hand: HandModel,
    shape: ArrayLike | None = None,
    *,
    seconds: float = 4.0,
    fps: float = 120.0,
    off_axis: float = 0.5,
    seed: int = 0,
) -> Motion:
    """A hand that makes a fist, pinches, spreads its fingers, and sways about the wrist meanwhile.

    Args:
        hand: the hand that moves.
        shape: its shape coefficients, unit variance each; None is the mean shape.
        seconds: length of the motion.
        fps: frames per second.
        off_axis: size of the joint rotations that hinges cannot follow; 1 is that of a real recording, 0 has none.
        seed: of those rotations.

    Raises:
        InputError: fewer than two frames, or what `build_rigid_hand` and `add_off_axis_rotation` refuse.
    """
    frames = round(seconds * fps) if np.isfinite([seconds, fps]).all() else 0
    if frames < 2 or fps <= 0:
        raise InputError(f"{seconds} s at {fps} frames/s; give two frames or more")
    rigid = build_rigid_hand(hand, shape)
    named = postures(np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper))
    angles = np.stack([named[name][0] if name != "flat" else np.zeros(20) for name in SEQUENCE])
    share = np.linspace(0.0, 1.0, frames)
    course = PchipInterpolator(np.linspace(0.0, 1.0, len(SEQUENCE)), angles)(share)  # monotone: no posture is overshot
    sway = np.sin(2 * np.pi * share)[:, None]
    rotations = np.asarray(joint_rotations(course, rigid), np.float64)
    return Motion(
        fps=float(fps),
        rotations=add_off_axis_rotation(rotations, seed, off_axis, fps) if off_axis else rotations,
        wrist_position=sway * np.array([0.03, 0.02, 0.05]),
        wrist_quaternion=Rotation.from_rotvec(sway * np.array([0.3, 0.1, 0.2])).as_quat(scalar_first=True),
        shape=np.zeros(hand.num_shape) if shape is None else np.asarray(shape, float),
        valid=np.ones(frames, bool),
        side=hand.side,
        source="sample motion",
    )
