"""`JointMotion`: a motion projected onto the 20 hinges of a rigid hand."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGES
from mjx_hand.motion.archive import load_arrays, save_arrays
from mjx_hand.pytree import pytree, static

SCHEMA = "mjx-hand/joint-motion/1"


@pytree
class JointMotion:
    """Hinge angles over time; radians, metres, quaternions wxyz.

    Attributes:
        fps: frames a second.
        angles: hinge angles in the order of `hand.joints.HINGES`.
        wrist_position: the wrist joint in the recording's world frame.
        wrist_quaternion: world from hand frame, wxyz.
        valid: False where the recording has a gap; the angles there are interpolated.
        side: "right" or "left".
        source: provenance, one line.
    """

    fps: float
    angles: Float[np.ndarray, "t 20"]
    wrist_position: Float[np.ndarray, "t 3"]
    wrist_quaternion: Float[np.ndarray, "t 4"]
    valid: Bool[np.ndarray, "t"]
    side: str = static(default="right")
    source: str = static(default="")

    @property
    def num_frames(self) -> int:
        return self.angles.shape[0]


def save_joint_motion(motion: JointMotion, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/joint-motion/1); `joint_names` records the hinge order."""
    save_arrays(
        path,
        SCHEMA,
        {
            "fps": motion.fps,
            "angles": motion.angles,
            "wrist_position": motion.wrist_position,
            "wrist_quaternion": motion.wrist_quaternion,
            "valid": motion.valid,
            "joint_names": np.array(HINGES),
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
    if tuple(a.get("joint_names", ())) != HINGES:
        raise InputError(f"{path}: its joint names are not this version's; retarget the recording again")
    return JointMotion(
        fps=float(a["fps"]),
        angles=a["angles"],
        wrist_position=a["wrist_position"],
        wrist_quaternion=a["wrist_quaternion"],
        valid=a["valid"].astype(bool),
        side=str(a["side"]),
        source=str(a["source"]),
    )
