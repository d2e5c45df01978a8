"""C3D, the biomechanics community's binary format (https://www.c3d.org), through ezc3d.

Units are the file's own (POINT:UNITS, millimetres where it says none, as the manual has it). Where POINT:X_SCREEN and
POINT:Y_SCREEN name axes, the recording is turned so that what was up on the screen is z, and what was right is x.
A point of residual below 0, or at exactly 0, 0, 0, was not seen.
"""

from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
from jaxtyping import Float

from mjx_hand.capture.marker_files.c3d_header import check_c3d
from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.marker_files.samples import recording_of
from mjx_hand.capture.recording import MarkerRecording
from mjx_hand.errors import InputError

_DIRECTIONS = ("+X", "+Y", "+Z", "-X", "-Y", "-Z")
_AXES = np.concatenate([np.eye(3), -np.eye(3)])


def _text(group: Any, name: str) -> str:
    """A parameter's first string, empty where it has none."""
    value = group[name]["value"] if name in group else []
    return str(value[0]).strip() if len(value) else ""


def screen_axes(path: Path, right: str, up: str) -> Float[np.ndarray, "3 3"]:
    """The rotation that takes the file's axes to x right, z up; none where they are not said.

    Raises:
        InputError: the two are on one axis.
    """
    names = [name.upper() if name[:1] in "+-" else f"+{name.upper()}" for name in (right, up)]
    if not all(name in _DIRECTIONS for name in names):
        return np.eye(3)
    x, z = (_AXES[_DIRECTIONS.index(name)] for name in names)
    if x @ z:
        raise InputError(f"{path}: X_SCREEN is {right} and Y_SCREEN {up}; expected two different axes")
    return np.stack([x, np.cross(z, x), z])


def _read(path: Path, units: str | None) -> MarkerRecording:
    check_c3d(path)
    try:
        file = ezc3d.c3d(str(path))
    except (RuntimeError, ValueError, IndexError, MemoryError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{path}: not a readable C3D file ({reason}); export it again") from None
    point, points = file["parameters"]["POINT"], file["data"]["points"]
    labels = [name for key in sorted(k for k in point if k.startswith("LABELS")) for name in point[key]["value"]]
    names = [str(name).strip() for name in labels][: points.shape[1]]
    if len(names) != points.shape[1]:
        raise InputError(f"{path}: {len(names)} labels for {points.shape[1]} points; label all trajectories")
    unseen = file["data"]["meta_points"]["residuals"][0] < 0
    positions = np.where(unseen, np.nan, points[:3]).transpose(2, 1, 0)
    turn = screen_axes(path, _text(point, "X_SCREEN"), _text(point, "Y_SCREEN"))
    fps = float(point["RATE"]["value"][0]) if "RATE" in point else 0.0
    return recording_of(path, names, positions @ turn.T, fps, units or _text(point, "UNITS") or "mm")


FORMAT = MarkerFormat(name="C3D (.c3d)", suffixes=(".c3d",), read=_read)
