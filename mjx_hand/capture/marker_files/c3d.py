"""C3D, the biomechanics community's binary format (https://www.c3d.org), from Intel, DEC and MIPS processors.

Units are the file's own (POINT:UNITS, millimetres where it says none, as the manual has it). Where POINT:X_SCREEN and
POINT:Y_SCREEN name axes, the recording is turned so that what was up on the screen is z, and what was right is x.
A point of residual below 0, or at exactly 0, 0, 0, was not seen.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.marker_files.c3d_header import LONG, C3DHeader, read_header
from mjx_hand.capture.marker_files.c3d_parameters import BLOCK, Parameters, read_parameters
from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.marker_files.samples import recording_of, timeline_at
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
    """The frames that are there: of the numbers that the file says the first that its length confirms.

    Files that were cropped or joined keep parameters of before, and headers have no room for long recordings. Where the
    length confirms none, the header's counts, which then promises more than there is, or is followed by other data.
    """
    trial, point = parameters.get("TRIAL", {}), parameters.get("POINT", {})
    first, last = (_long(trial.get(f"ACTUAL_{end}_FIELD", [])) for end in ("START", "END"))
    said = list(header.frames)
    said += [last - first + 1] if first and last >= first else []
    said += [int(count) for name in ("LONG_FRAMES", "FRAMES") if (count := _positive(point.get(name)))]
    size = max(header.frame_bytes, 1)
    there = len(content) - header.data
    # What is after the last frame fills up its block.
    confirmed = [frames for frames in said if 0 <= there - frames * size < BLOCK]
    long = [frames for frames in said if frames > LONG]
    if confirmed or header.frames or long:
        return [*confirmed, *header.frames, *long][0]
    frames = there // size
    while frames and not any(content[header.data + (frames - 1) * size : header.data + frames * size]):
        frames -= 1  # the last block is filled up with zeros
    return frames


def _positive(values: list | None) -> float:
    """The first of a parameter's values if it is a number above 0, else 0."""
    first = values[0] if values else 0.0
    return float(first) if not isinstance(first, str) and np.isfinite(first) and first > 0 else 0.0


def frame_rate(header: C3DHeader, parameters: Parameters) -> tuple[float | None, tuple[str, ...]]:
    """Frames per second: POINT:RATE's, else the header's; and a note where the two differ.

    Then the one counts that the analog rate confirms, else POINT:RATE, as the manual has it.
    """
    point, analog = (_positive(parameters.get(group, {}).get("RATE")) for group in ("POINT", "ANALOG"))
    rates = [rate for rate in (point, header.rate) if rate]
    if len(rates) < 2 or _same(*rates):
        return (rates[0] if rates else None), ()
    by_analog = analog / header.samples if header.samples else 0.0
    rate = next((rate for rate in rates if _same(rate, by_analog)), point)
    return rate, (f"POINT:RATE is {point:g} and the header's rate {header.rate:g}; {rate:g} frames/s is taken",)


def _same(a: float, b: float) -> bool:
    return abs(a - b) <= 0.02 * a


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


def _read(path: Path, units: str | None, fps: float | None) -> MarkerRecording:
    content = path.read_bytes()
    header = read_header(path, content)
    try:
        parameters = read_parameters(content[header.parameters : header.data], header.numbers)
    except ValueError as error:
        raise InputError(f"{path}: damaged C3D parameters ({error}); export it again") from None
    point = parameters.get("POINT", {})
    # More labels than 255 go on in LABELS2 and so forth. Calculated points may have none.
    names = [name for key in sorted(k for k in point if k.startswith("LABELS")) for name in point[key]]
    names = [name if isinstance(name, str) else "" for name in [*names, *[""] * header.points][: header.points]]
    positions = points_of(path, content, header, number_of_frames(header, parameters, content))
    right, up, unit = (str((point.get(name) or [""])[0]) for name in ("X_SCREEN", "Y_SCREEN", "UNITS"))
    stated, notes = frame_rate(header, parameters)
    timeline = timeline_at(path, len(positions), stated, fps)
    return recording_of(path, names, positions @ screen_axes(path, right, up).T, timeline, units or unit or "mm", notes)


FORMAT = MarkerFormat(name="C3D (.c3d)", suffixes=(".c3d",), read=_read)
