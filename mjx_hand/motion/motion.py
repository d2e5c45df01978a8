"""`Motion`: a recorded hand as a MANO-layout pose sequence."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import Lines, numbers, text, texts
from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.hand.joints import FINGERS, NUM_BALL_JOINTS, NUM_LINKS
from mjx_hand.pytree import pytree, static

SCHEMA = "mjx-hand/motion/1"
LAYOUT: dict[str, tuple[int | str, ...]] = {
    "fps": (),
    "rotations": ("t", NUM_BALL_JOINTS, 3, 3),
    "wrist_position": ("t", 3),
    "wrist_quaternion": ("t", 4),
    "shape": ("s",),
    "valid": ("t",),
}
_BY_FRAME = {"rotations": np.eye(3), "wrist_position": np.zeros(3), "wrist_quaternion": np.array([1.0, 0, 0, 0])}
OFFSETS = {"link_offset": NUM_LINKS, "tip_offset": len(FINGERS)}  # a recording may have them


@pytree
class Motion:
    """A pose sequence; metres, seconds, quaternions wxyz.

    Attributes:
        fps: frames per second.
        rotations: the 15 MANO joints' rotations relative to their parents, about the flat hand. Frames that
            are not valid hold the identity, never NaN.
        wrist_position: the wrist joint in the world (or camera) frame of the recording.
        wrist_quaternion: world from hand frame, wxyz.
        shape: MANO shape coefficients, one set for the whole sequence.
        link_offset: the subject's own joint centres relative to each parent's (m), or None to use the shape's.
        tip_offset: the subject's own finger tips in the last links' frames (m, in the order of `FINGERS`), or None.
        valid: whether the frame was recorded (False in gaps).
        side: "right" or "left".
        source: provenance, one line.
        warnings: what is doubtful about it, one line each.
    """

    fps: float
    rotations: Float[np.ndarray, "t 15 3 3"]
    wrist_position: Float[np.ndarray, "t 3"]
    wrist_quaternion: Float[np.ndarray, "t 4"]
    shape: Float[np.ndarray, "s"]
    valid: Bool[np.ndarray, "t"]
    link_offset: Float[np.ndarray, "16 3"] | None = None
    tip_offset: Float[np.ndarray, "5 3"] | None = None
    side: str = static(default="right")
    source: str = static(default="")
    warnings: Lines = static(default=())

    @property
    def num_frames(self) -> int:
        """How many frames there are, gaps included."""
        return self.rotations.shape[0]


def check_motion(motion: Motion, name: str = "") -> Motion:
    """Return `motion` if it is well formed.

    Args:
        motion: what to check.
        name: what messages call it, such as its file; its source if empty.

    Raises:
        InputError: it is empty, or shapes, rotations, quaternions, bones, fps or side are not valid.
    """
    name = name or motion.source or "motion"
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
    length = np.linalg.norm(motion.wrist_quaternion, axis=1)
    if (np.abs(length - 1) > 1e-3).any():
        worst = int(np.argmax(np.abs(length - 1)))
        raise InputError(f"{name}: frame {worst}'s wrist_quaternion has length {length[worst]:.3g}, expected 1 (wxyz)")
    if np.ndim(motion.shape) != 1 or not np.isfinite(motion.shape).all():
        raise InputError(f"{name}: shape has dimensions {np.shape(motion.shape)}; expected a list of finite numbers")
    for field, rows in OFFSETS.items():
        offset = getattr(motion, field)
        if offset is not None and (np.shape(offset) != (rows, 3) or not np.isfinite(offset).all()):
            raise InputError(f"{name}: {field} has shape {np.shape(offset)}; expected ({rows}, 3), all finite")
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
    if motion.warnings:
        arrays["warnings"] = np.array(motion.warnings)
    for field in OFFSETS:
        if getattr(motion, field) is not None:
            arrays[field] = getattr(motion, field)
    save_arrays(path, SCHEMA, arrays)


def load_motion_file(path: str | Path) -> Motion:
    """Read a motion that `save_motion` wrote. Frames that hold NaN or infinity become gaps.

    Raises:
        InputError: not such a file, or its contents are not a well-formed motion.
    """
    a = load_arrays(path, SCHEMA)
    n = numbers(path, _without_bad_frames(numbers(path, a, LAYOUT, finite=False)), LAYOUT)
    offsets = numbers(path, a, {field: (rows, 3) for field, rows in OFFSETS.items() if field in a})
    return check_motion(
        Motion(
            fps=float(n["fps"]),
            rotations=n["rotations"],
            wrist_position=n["wrist_position"],
            wrist_quaternion=n["wrist_quaternion"],
            shape=n["shape"],
            valid=n["valid"].astype(bool),
            link_offset=offsets.get("link_offset"),
            tip_offset=offsets.get("tip_offset"),
            side=text(path, a, "side"),
            source=text(path, a, "source"),
            warnings=texts(path, a, "warnings", needed=False),
        ),
        name=str(path),
    )


def _without_bad_frames(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Frames that are not finite marked as gaps, which hold the identity; nothing is changed if all are bad."""
    finite = [np.isfinite(arrays[field]).all(axis=tuple(range(1, arrays[field].ndim))) for field in _BY_FRAME]
    good = np.logical_and.reduce(finite)
    if good.all() or not good.any():
        return arrays
    mended = {
        field: np.where(good.reshape(-1, *(1,) * (arrays[field].ndim - 1)), arrays[field], held)
        for field, held in _BY_FRAME.items()
    }
    return arrays | mended | {"valid": good & (arrays["valid"] > 0)}
