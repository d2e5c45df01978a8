"""`Motion`: a recorded hand as a MANO-layout pose sequence."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.motion.archive import load_arrays, save_arrays
from mjx_hand.pytree import pytree, static

SCHEMA = "mjx-hand/motion/1"


@pytree
class Motion:
    """A pose sequence; metres, seconds, quaternions wxyz.

    Attributes:
        fps: frames a second.
        rotations: the 15 MANO joints' rotations relative to their parents, about the flat hand. Frames that
            are not valid hold the identity, never NaN.
        wrist_position: the wrist joint in the world (or camera) frame of the recording.
        wrist_quaternion: world from hand frame, wxyz.
        shape: MANO shape coefficients, one set for the whole sequence.
        link_offset: the subject's own joint centres relative to each parent's (m), or None to use the shape's.
        valid: whether the frame was recorded (False in gaps).
        side: "right" or "left".
        source: provenance, one line.
    """

    fps: float
    rotations: Float[np.ndarray, "t 15 3 3"]
    wrist_position: Float[np.ndarray, "t 3"]
    wrist_quaternion: Float[np.ndarray, "t 4"]
    shape: Float[np.ndarray, "s"]
    valid: Bool[np.ndarray, "t"]
    link_offset: Float[np.ndarray, "16 3"] | None = None
    side: str = static(default="right")
    source: str = static(default="")

    @property
    def num_frames(self) -> int:
        return self.rotations.shape[0]


def check_motion(motion: Motion) -> Motion:
    """Return `motion` if it is well formed.

    Raises:
        InputError: it is empty, or shapes, rotations, quaternions, fps or side are not valid.
    """
    name = motion.source or "motion"
    frames = motion.rotations.shape[0]
    if frames == 0:
        raise InputError(f"{name}: the recording has no frames")
    expected = {
        "rotations": (frames, 15, 3, 3),
        "wrist_position": (frames, 3),
        "wrist_quaternion": (frames, 4),
        "valid": (frames,),
    }
    for field, shape in expected.items():
        found = np.shape(getattr(motion, field))
        if found != shape:
            raise InputError(f"{name}: {field} has shape {found}, expected {shape}")
    if not np.isfinite(motion.fps) or motion.fps <= 0:
        raise InputError(f"{name}: fps is {motion.fps}, expected a positive number")
    if motion.side not in ("right", "left"):
        raise InputError(f"{name}: side is {motion.side!r}, expected 'right' or 'left'")
    if not motion.valid.any():
        raise InputError(f"{name}: all {frames} frames are gaps; nothing to retarget")
    good = motion.valid
    for field in ("rotations", "wrist_position", "wrist_quaternion"):
        bad = ~np.isfinite(getattr(motion, field)).reshape(frames, -1).all(axis=1)
        if bad.any():
            raise InputError(
                f"{name}: {field} has NaN or infinity in {bad.sum()} frames, first {int(np.argmax(bad))}; "
                "mark gaps as valid=False and hold the identity there"
            )
    r = motion.rotations[good]
    off = np.abs(r @ np.swapaxes(r, -1, -2) - np.eye(3)).max(axis=(1, 2, 3))
    flipped = np.linalg.det(r).min(axis=1) < 0
    if (off > 1e-3).any() or flipped.any():
        worst = int(np.flatnonzero(good)[np.argmax(np.where(flipped, np.inf, off))])
        raise InputError(f"{name}: frame {worst} holds matrices that are not rotations (orthonormal, determinant +1)")
    return motion


def save_motion(motion: Motion, path: str | Path) -> None:
    """Write a motion as `.npz` (schema mjx-hand/motion/1; the attributes' names and units)."""
    arrays = {
        "fps": motion.fps,
        "rotations": motion.rotations,
        "wrist_position": motion.wrist_position,
        "wrist_quaternion": motion.wrist_quaternion,
        "shape": motion.shape,
        "valid": motion.valid,
        "side": motion.side,
        "source": motion.source,
    }
    if motion.link_offset is not None:
        arrays["link_offset"] = motion.link_offset
    save_arrays(path, SCHEMA, arrays)


def load_motion_file(path: str | Path) -> Motion:
    """Read a motion that `save_motion` wrote, checked."""
    a = load_arrays(path, SCHEMA)
    try:
        motion = Motion(
            fps=float(a["fps"]),
            rotations=a["rotations"],
            wrist_position=a["wrist_position"],
            wrist_quaternion=a["wrist_quaternion"],
            shape=a["shape"],
            valid=a["valid"].astype(bool),
            link_offset=a.get("link_offset"),
            side=str(a["side"]),
            source=str(a["source"]),
        )
    except KeyError as error:
        raise InputError(f"{path}: a motion file without {error.args[0]!r}") from None
    return check_motion(motion)
