"""`KeypointRecording`: one hand's 21 keypoints over time, and its file."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.layouts import KEYPOINTS, NUM_KEYPOINTS
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import Lines, numbers, text, texts
from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.pytree import pytree, static

SCHEMA = "mjx-hand/keypoints/1"
SIDES = ("right", "left")


@pytree
class KeypointRecording:
    """One hand's keypoints over time; metres, in the recording's frame.

    Attributes:
        fps: frames per second; None where nobody has said.
        positions: the 21 keypoints in the order of `layouts.KEYPOINTS`; NaN where one is missing.
        side: "right", "left", or "" where the recording does not say.
        layout: name of the device's layout in `layouts.LAYOUTS`.
        source: provenance, one line.
        warnings: what is doubtful about it, one line each.
    """

    fps: float | None
    positions: Float[np.ndarray, "t 21 3"]
    side: str = static(default="")
    layout: str = static(default="mediapipe")
    source: str = static(default="")
    warnings: Lines = static(default=())

    @property
    def num_frames(self) -> int:
        """How many frames there are, gaps included."""
        return self.positions.shape[0]


def check_keypoints(recording: KeypointRecording) -> KeypointRecording:
    """Return `recording` if it is well formed.

    Raises:
        InputError: it has no frames or no keypoint anywhere, or its shape, rate or side is not valid.
    """
    name = recording.source or "keypoints"
    shape = np.shape(recording.positions)
    if len(shape) != 3 or shape[1:] != (NUM_KEYPOINTS, 3):
        raise InputError(f"{name}: positions have shape {shape}, expected (frames, {NUM_KEYPOINTS}, 3)")
    if shape[0] == 0:
        raise InputError(f"{name}: the recording has no frames")
    if not np.isfinite(recording.positions).any():
        raise InputError(f"{name}: all {shape[0]} frames are gaps; no keypoint was seen")
    if recording.fps is not None and not (np.isfinite(recording.fps) and recording.fps > 0):
        raise InputError(f"{name}: fps is {recording.fps}, expected a positive number")
    if recording.side not in ("", *SIDES):
        raise InputError(f"{name}: side is {recording.side!r}, expected 'right' or 'left'")
    return recording


def save_keypoints(recording: KeypointRecording, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/keypoints/1); `names` records the keypoints' order.

    Raises:
        InputError: the recording is not well formed, or has no frame rate.
    """
    check_keypoints(recording)
    if recording.fps is None:
        raise InputError(f"{recording.source or 'keypoints'}: the frame rate is not known; give fps, as in fps=30")
    arrays: dict[str, np.ndarray | float | str] = {
        "fps": recording.fps,
        "positions": recording.positions,
        "names": np.array(KEYPOINTS),
        "side": recording.side,
        "layout": recording.layout,
        "source": recording.source,
    }
    if recording.warnings:
        arrays["warnings"] = np.array(recording.warnings)
    save_arrays(path, SCHEMA, arrays)


def load_keypoint_file(path: str | Path) -> KeypointRecording:
    """Read what `save_keypoints` wrote, checked.

    Raises:
        InputError: not such a file, or made for another order of keypoints.
    """
    a = load_arrays(path, SCHEMA)
    if "names" not in a or texts(path, a, "names") != KEYPOINTS:
        raise InputError(f"{path}: its keypoints' names are not this version's; make it again from the recording")
    n = numbers(path, a, {"fps": (), "positions": ("t", NUM_KEYPOINTS, 3)}, finite=False)
    return check_keypoints(
        KeypointRecording(
            fps=float(n["fps"]),
            positions=n["positions"].astype(float),
            side=text(path, a, "side"),
            layout=text(path, a, "layout"),
            source=text(path, a, "source"),
            warnings=texts(path, a, "warnings", needed=False),
        )
    )
