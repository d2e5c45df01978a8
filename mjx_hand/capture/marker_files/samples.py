"""What all readers of marker files share: from labels and numbers to a checked `MarkerRecording` in metres."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.markers.marker_recording import MarkerRecording, check_recording
from mjx_hand.errors import InputError

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
_WORDS = {"meter": "m", "metre": "m", "centimeter": "cm", "millimeter": "mm", "millimetre": "mm", "inch": "in"}


def unit_metres(path: Path, unit: str) -> float:
    """How many metres a unit is: m, cm, mm or in, also spelt out.

    Raises:
        InputError: it is none of these.
    """
    word = unit.strip().strip("()[]").lower()
    word = _WORDS.get(word.removesuffix("s"), word)
    if word not in METRES:
        raise InputError(f"{path}: unit {unit!r} is unknown; valid are {', '.join(METRES)}: say it with --units")
    return METRES[word]


def recording_of(
    path: Path, names: list[str], positions: Float[np.ndarray, "t m 3"], fps: float, unit: str
) -> MarkerRecording:
    """The recording of positions in `unit`. A marker that is NaN, or exactly 0, 0, 0, was not seen in that frame.

    Raises:
        InputError: names repeat, nothing was seen, or the rate is not positive.
    """
    if not names:
        raise InputError(f"{path}: no markers in it; export the labelled trajectories")
    seen = np.isfinite(positions).all(axis=2) & (positions != 0).any(axis=2)
    if positions.shape[0] == 0:
        raise InputError(f"{path}: no frames in it, only a header; export the recording again")
    if not seen.any():
        raise InputError(f"{path}: none of its {len(names)} markers is seen in any of {len(positions)} frames")
    metres = np.where(seen[..., None], positions, 0.0) * unit_metres(path, unit)
    return check_recording(
        MarkerRecording(fps=float(fps), positions=metres, visible=seen, names=tuple(names), source=path.name)
    )
