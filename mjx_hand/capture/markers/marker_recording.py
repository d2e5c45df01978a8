"""`MarkerRecording`: labelled optical markers over time, and its file."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import Lines, numbers, text, texts
from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.pytree import pytree, replace, static

SCHEMA = "mjx-hand/markers/1"


@pytree
class MarkerRecording:
    """Labelled markers over time; metres, in the capture system's frame.

    Attributes:
        fps: frames per second.
        positions: marker centres; zero where a marker is not visible, never NaN.
        visible: whether the marker was seen in the frame.
        names: the markers' labels.
        source: provenance, one line.
        warnings: what is doubtful about it, one line each.
    """

    fps: float
    positions: Float[np.ndarray, "t m 3"]
    visible: Bool[np.ndarray, "t m"]
    names: tuple[str, ...] = static()
    source: str = static(default="")
    warnings: Lines = static(default=())

    @property
    def num_frames(self) -> int:
        """How many frames there are, gaps included."""
        return self.positions.shape[0]


def check_recording(recording: MarkerRecording) -> MarkerRecording:
    """Return `recording` if it is well formed.

    Raises:
        InputError: it is empty, shapes disagree, names repeat, or a visible position is not finite.
    """
    name = recording.source or "recording"
    frames, markers = recording.num_frames, len(recording.names)
    if frames == 0 or markers == 0:
        raise InputError(f"{name}: {frames} frames of {markers} markers; give at least one of each")
    for field, shape in {"positions": (frames, markers, 3), "visible": (frames, markers)}.items():
        found = np.shape(getattr(recording, field))
        if found != shape:
            raise InputError(f"{name}: {field} has shape {found}, expected {shape} for its {markers} names")
    repeated = sorted(name for name, count in Counter(recording.names).items() if count > 1)
    if repeated:
        raise InputError(f"{name}: marker names repeat: {', '.join(repeated)}; give each marker its own name")
    if not np.isfinite(recording.fps) or recording.fps <= 0:
        raise InputError(f"{name}: fps is {recording.fps}, expected a positive number")
    bad = ~np.isfinite(recording.positions).all(axis=2)
    if bad.any():
        t, m = np.argwhere(bad)[0]
        raise InputError(
            f"{name}: marker {recording.names[m]!r} is NaN or infinite in frame {t}; "
            "mark gaps as visible=False and hold zero there"
        )
    return recording


def select_markers(recording: MarkerRecording, names: Sequence[str]) -> MarkerRecording:
    """The recording with only these markers, in this order.

    Raises:
        InputError: the recording lacks one of them.
    """
    missing = [n for n in names if n not in recording.names]
    if missing:
        raise InputError(
            f"{recording.source or 'recording'}: no marker {', '.join(map(repr, missing))}; "
            f"it has {', '.join(recording.names)}"
        )
    at = [recording.names.index(n) for n in names]
    return replace(
        recording, positions=recording.positions[:, at], visible=recording.visible[:, at], names=tuple(names)
    )


def hide_marker(recording: MarkerRecording, name: str) -> MarkerRecording:
    """The recording as if this marker had never been seen.

    Raises:
        InputError: the recording lacks it.
    """
    if name not in recording.names:
        raise InputError(
            f"{recording.source or 'recording'}: no marker {name!r} to leave out; it has {', '.join(recording.names)}"
        )
    hidden = np.array(recording.names) == name
    return replace(
        recording,
        positions=np.where(hidden[:, None], 0.0, recording.positions),
        visible=recording.visible & ~hidden,
    )


def save_recording(recording: MarkerRecording, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/markers/1; the attributes' names and units)."""
    arrays = {
        "fps": recording.fps,
        "positions": recording.positions,
        "visible": recording.visible,
        "names": np.array(recording.names),
        "source": recording.source,
    }
    if recording.warnings:
        arrays["warnings"] = np.array(recording.warnings)
    save_arrays(path, SCHEMA, arrays)


def load_recording_file(path: str | Path) -> MarkerRecording:
    """Read what `save_recording` wrote, checked.

    Raises:
        InputError: not such a file, or its contents are not a well-formed recording.
    """
    a = load_arrays(path, SCHEMA)
    n = numbers(path, a, {"fps": (), "positions": ("t", "m", 3), "visible": ("t", "m")}, finite=False)
    return check_recording(
        MarkerRecording(
            fps=float(n["fps"]),
            positions=n["positions"],
            visible=n["visible"].astype(bool),
            names=texts(path, a, "names"),
            source=text(path, a, "source"),
            warnings=texts(path, a, "warnings", needed=False),
        )
    )
