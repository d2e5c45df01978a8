"""Markers as a plain table: columns `NAME_x`, `NAME_y`, `NAME_z` for each marker, commas between.

    # units: mm
    # rate: 120
    time,index_tip_x,index_tip_y,index_tip_z,...
    0.000,110.4,135.1,460.6,...

Lines that start with `#` say the unit (m, cm, mm, in) and the frames per second. Without a rate, a column `time`, `t`
or `timestamp` in seconds gives it. A column `frame` is passed over, others are refused. Gaps are empty, `nan` or zero.
"""

import re
from pathlib import Path

import numpy as np

from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.marker_files.samples import recording_of
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.files.text_table import numbers_of, positive, read_lines

_TIME = ("time", "t", "timestamp")
_UNEVEN = 0.5  # share of the mean step by which a step may differ: rounded times do, a dropped frame by more


def _comments(lines: list[str]) -> dict[str, str]:
    pairs = (line.lstrip("# ").split(":", 1) for line in lines if line.startswith("#") and ":" in line)
    return {key.strip().lower(): value.strip() for key, value in pairs}


def _rate(path: Path, said: dict[str, str], columns: list[str], table: np.ndarray) -> float:
    if "rate" in said:
        return positive(path, "rate", said["rate"])
    at = [k for k, column in enumerate(columns) if column.lower() in _TIME]
    if not at:
        raise InputError(f"{path}: no frame rate; add a line '# rate: 120' or a column 'time' in seconds")
    times = table[:, at[0]]
    steps = np.diff(times)
    step = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 0.0
    if not (step > 0 and (np.abs(steps - step) < _UNEVEN * step).all()):  # NaN is uneven too
        raise InputError(
            f"{path}: the times in column {columns[at[0]]!r} are not evenly spaced; resample the recording"
        )
    return float(1 / step)


def _read(path: Path, units: str | None) -> MarkerRecording:
    lines = read_lines(path)
    said = _comments(lines)
    body = [(k, line) for k, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if not body:
        raise InputError(f"{path}: no table in it; give a line of column names and one line a frame")
    titles, rows = body[0][1], body[1:]
    columns = [cell.strip() for cell in titles.split(",")]
    found = [re.fullmatch(r"(.+)_([xyzXYZ])", column) for column in columns]
    others = [c for c, match in zip(columns, found, strict=True) if not match and c.lower() not in (*_TIME, "frame")]
    if others:
        raise InputError(f"{path}: column {others[0]!r} is unknown; valid are NAME_x, NAME_y, NAME_z, time, frame")
    axes = [(match[1], match[2].lower()) for match in found if match]
    repeated = sorted({name for name, axis in axes if axes.count((name, axis)) > 1})
    if repeated:
        raise InputError(f"{path}: marker names repeat: {', '.join(repeated)}; give each marker its own name")
    names = list(dict.fromkeys(name for name, _ in axes))
    lacking = [f"{name}_{axis}" for name in names for axis in "xyz" if (name, axis) not in axes]
    if lacking:
        raise InputError(f"{path}: column {lacking[0]!r} is missing; a marker has x, y and z")
    unit = units or said.get("units")
    if unit is None:
        raise InputError(f"{path}: no unit; add a line '# units: mm' to the file, or say it with --units")
    table = numbers_of(path, [line for _, line in rows], ",", len(columns), rows[0][0] if rows else 0)
    where = {match.group(1, 2): k for k, match in enumerate(found) if match}
    order = [where.get((name, axis), where.get((name, axis.upper()), -1)) for name in names for axis in "xyz"]
    positions = table[:, order].reshape(len(table), len(names), 3)
    return recording_of(path, names, positions, _rate(path, said, columns, table), unit)


FORMAT = MarkerFormat(name="CSV with columns NAME_x, NAME_y, NAME_z (.csv)", suffixes=(".csv",), read=_read)
