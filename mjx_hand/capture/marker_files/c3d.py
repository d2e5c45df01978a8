"""C3D, the biomechanics community's binary format (https://www.c3d.org), from Intel, DEC and MIPS processors.

Units are the file's own (POINT:UNITS, millimetres where it says none, as the manual has it). Where POINT:X_SCREEN and
POINT:Y_SCREEN name axes, the recording is turned so that what was up on the screen is z, and what was right is x.
A point of residual below 0, or at exactly 0, 0, 0, was not seen.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.marker_files.c3d_header import LONG, C3DHeader, read_header
from mjx_hand.capture.marker_files.c3d_parameters import Parameters, read_parameters
from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.marker_files.samples import recording_of
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError

_DIRECTIONS = ("+X", "+Y", "+Z", "-X", "-Y", "-Z")
_AXES = np.concatenate([np.eye(3), -np.eye(3)])


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


def number_of_frames(header: C3DHeader, parameters: Parameters, content: bytes) -> int:
    """The frames that the file promises; for long recordings that promise none, those that are there."""
    trial, point = parameters.get("TRIAL", {}), parameters.get("POINT", {})
    first, last = (_long(trial.get(f"ACTUAL_{end}_FIELD", [])) for end in ("START", "END"))
    if first and last and last >= first:
        return last - first + 1
    if header.frames is not None:
        return header.frames
    said = (point.get("LONG_FRAMES") or point.get("FRAMES") or [-1])[0]
    if said > LONG:
        return int(said)
    size = max(header.frame_bytes, 1)
    frames = (len(content) - header.data) // size
    while frames and not any(content[header.data + (frames - 1) * size : header.data + frames * size]):
        frames -= 1  # the last block is filled up with zeros
    return frames


def _long(words: list) -> int:
    """A number of two 16-bit words, the lower first."""
    return int(words[0]) % 2**16 + 2**16 * (int(words[1]) % 2**16) if len(words) == 2 else 0


def points_of(path: Path, content: bytes, header: C3DHeader, frames: int) -> Float[np.ndarray, "t m 3"]:
    """Coordinates in the file's unit, NaN where a point was not seen.

    Raises:
        InputError: the file is shorter than it promises.
    """
    wanted = header.data + frames * header.frame_bytes
    if len(content) < wanted:
        raise InputError(f"{path}: {len(content)} of {wanted} bytes are there; the file is truncated, export it again")
    read = header.numbers.floats if header.scale < 0 else header.numbers.integers
    values = read(content[header.data : wanted]).reshape(frames, 4 * header.points + header.analog)
    points = values[:, : 4 * header.points].reshape(frames, header.points, 4).astype(np.float64)
    if header.scale > 0:
        points[..., :3] *= header.scale
    return np.where(points[..., 3:] < 0, np.nan, points[..., :3])


def _read(path: Path, units: str | None) -> MarkerRecording:
    content = path.read_bytes()
    header = read_header(path, content)
    try:
        parameters = read_parameters(content[header.parameters : header.data], header.numbers)
    except ValueError as error:
        raise InputError(f"{path}: damaged C3D parameters ({error}); export it again") from None
    point = parameters.get("POINT", {})
    # More labels than 255 go on in LABELS2 and so forth.
    names = [name for key in sorted(k for k in point if k.startswith("LABELS")) for name in point[key]][: header.points]
    if len(names) != header.points or not all(isinstance(name, str) and name for name in names):
        raise InputError(f"{path}: {len(names)} labels for {header.points} points; label all trajectories")
    positions = points_of(path, content, header, number_of_frames(header, parameters, content))
    right, up, unit = (str((point.get(name) or [""])[0]) for name in ("X_SCREEN", "Y_SCREEN", "UNITS"))
    fps = float((point.get("RATE") or [np.nan])[0])
    return recording_of(path, names, positions @ screen_axes(path, right, up).T, fps, units or unit or "mm")


FORMAT = MarkerFormat(name="C3D (.c3d)", suffixes=(".c3d",), read=_read)
