"""`JointMotion`: a motion projected onto the 20 hinges of a rigid hand."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import Lines, numbers, text, texts
from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.files.npz_reader import Arrays
from mjx_hand.hand.joints import HINGES, NUM_HINGES
from mjx_hand.pytree import pytree, static

SCHEMA = "mjx-hand/joint-motion/1"
LAYOUT: dict[str, tuple[int | str, ...]] = {
    "fps": (),
    "angles": ("t", NUM_HINGES),
    "wrist_position": ("t", 3),
    "wrist_quaternion": ("t", 4),
    "valid": ("t",),
}


@pytree
class JointMotion:
    """A hand's joints over time; radians, metres, quaternions wxyz.

    Attributes:
        fps: frames per second.
        angles: of its joints, in the order of `joint_names`.
        wrist_position: the wrist joint in the recording's world frame.
        wrist_quaternion: world from hand frame, wxyz.
        valid: False where the recording has a gap; the angles there are interpolated.
        side: "right" or "left".
        source: provenance, one line.
        warnings: what is doubtful about it, one line each.
        joint_names: the human hand's hinges, or a robot's actuated joints.
    """

    fps: float
    angles: Float[np.ndarray, "t j"]
    wrist_position: Float[np.ndarray, "t 3"]
    wrist_quaternion: Float[np.ndarray, "t 4"]
    valid: Bool[np.ndarray, "t"]
    side: str = static(default="right")
    source: str = static(default="")
    warnings: Lines = static(default=())
    joint_names: Lines = static(default=HINGES)

    @property
    def num_frames(self) -> int:
        """How many frames there are, gaps included."""
        return self.angles.shape[0]


def save_joint_motion(motion: JointMotion, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/joint-motion/1); `joint_names` records the hinge order."""
    warnings = {"warnings": np.array(motion.warnings)} if motion.warnings else {}
    save_arrays(
        path,
        SCHEMA,
        {
            **warnings,
            "fps": motion.fps,
            "angles": motion.angles,
            "wrist_position": motion.wrist_position,
            "wrist_quaternion": motion.wrist_quaternion,
            "valid": motion.valid,
            "joint_names": np.array(motion.joint_names),
            "side": motion.side,
            "source": motion.source,
        },
    )


def load_joint_motion(path: str | Path) -> JointMotion:
    """Read what `save_joint_motion` wrote.

    Raises:
        InputError: not such a file, or made for another joint order.
    """
    a = load_arrays(path, SCHEMA)
    return joint_motion_of(path, a, text(path, a, "source"))


def joint_motion_of(path: str | Path, arrays: Arrays, source: str) -> JointMotion:
    """The joint motion among a file's arrays, checked.

    Raises:
        InputError: arrays are missing, unsound, or made for another joint order.
    """
    if "joint_names" not in arrays or texts(path, arrays, "joint_names") != HINGES:
        raise InputError(f"{path}: its joint names are not this version's; make it again from the recording")
    n = numbers(path, arrays, LAYOUT)
    fps, side = float(n["fps"]), text(path, arrays, "side")
    if len(n["angles"]) == 0 or fps <= 0 or side not in ("right", "left"):
        raise InputError(
            f"{path}: {len(n['angles'])} frames at {fps} frames per second of a {side!r} hand; "
            "expected at least one frame, a positive rate, and 'right' or 'left'"
        )
    return JointMotion(
        fps=fps,
        angles=n["angles"],
        wrist_position=n["wrist_position"],
        wrist_quaternion=n["wrist_quaternion"],
        valid=n["valid"].astype(bool),
        side=side,
        source=source,
        warnings=texts(path, arrays, "warnings", needed=False),
    )
