"""Markers as a plain table: columns `NAME_x`, `NAME_y`, `NAME_z` for each marker, commas between.

    # units: mm
    # rate: 120
    time,index_tip_x,index_tip_y,index_tip_z,...
    0.000,110.4,135.1,460.6,...

Lines that start with `#` say the unit (m, cm, mm, in) and the frames per second. Without a rate, a column `time`, `t`
or `timestamp` gives it; rows that its steps, or those of a column `frame`, leave out are gaps. Others are refused. A
marker is not seen where its cells are empty, `nan` or zero.
"""

import re
from pathlib import Path

from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.marker_files.samples import recording_of, timeline_at
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.capture.timeline.clock_names import names_numbers, names_time
from mjx_hand.errors import InputError
from mjx_hand.files.text_table import numbers_of, positive, read_lines


def _comments(lines: list[str]) -> dict[str, str]:
    pairs = (line.lstrip("# ").split(":", 1) for line in lines if line.startswith("#") and ":" in line)
    return {key.strip().lower(): value.strip() for key, value in pairs}


def _read(path: Path, units: str | None, fps: float | None) -> MarkerRecording:
    lines = read_lines(path)
    said = _comments(lines)
    body = [(k, line) for k, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if not body:
        raise InputError(f"{path}: no table in it; give a line of column names and one line per frame")
    columns, rows = [cell.strip() for cell in body[0][1].split(",")], body[1:]
    names, where = _markers(path, columns)
    time, number = (
        next((k for k, column in enumerate(columns) if named(column)), None) for named in (names_time, names_numbers)
    )
    unit = units or said.get("units")
    if unit is None:
        raise InputError(f"{path}: no unit; add a line '# units: mm' to the file, or say it with --units")
    stated = positive(path, "rate", said["rate"]) if "rate" in said else None
    if stated is None and fps is None and time is None:
        raise InputError(
            f"{path}: no frame rate; add a line '# rate: 120' or a column 'time' in seconds, or say it with --fps"
        )
    table = numbers_of(path, [line for _, line in rows], ",", len(columns), rows[0][0] if rows else 0)
    timeline = timeline_at(
        path,
        len(table),
        stated,
        fps,
        times=None if time is None else table[:, time],
        name="" if time is None else columns[time],
        numbers=None if number is None else table[:, number],
    )
    positions = table[:, where].reshape(len(table), len(names), 3)
    return recording_of(path, names, positions, timeline, unit)


def _markers(path: Path, columns: list[str]) -> tuple[list[str], list[int]]:
    """The markers, one that stands there twice twice, and the columns of their x, y and z, one after the other.

    Raises:
        InputError: a column is unknown, or a marker lacks one.
    """
    found: dict[str, dict[str, list[int]]] = {}
    for k, column in enumerate(columns):
        match = re.fullmatch(r"(.+)_([xyzXYZ])", column)
        if match:
            found.setdefault(match[1], {axis: [] for axis in "xyz"})[match[2].lower()].append(k)
        elif not (names_time(column) or names_numbers(column)):
            raise InputError(f"{path}: column {column!r} is unknown; valid are NAME_x, NAME_y, NAME_z, time, frame")
    lacking = next((f"{name}_{axis}" for name, axes in found.items() for axis in axes if not axes[axis]), None)
    if lacking:
        raise InputError(f"{path}: column {lacking!r} is missing; a marker has x, y and z")
    names: list[str] = []
    where: list[int] = []
    for name, axes in found.items():
        # Which x belongs to which y of a name that repeats is not told; the marker is left out, so that any will do.
        for k in range(max(map(len, axes.values()))):
            names.append(name)
            where += [at[min(k, len(at) - 1)] for at in axes.values()]
    return names, where


FORMAT = MarkerFormat(name="CSV with columns NAME_x, NAME_y, NAME_z (.csv)", suffixes=(".csv",), read=_read)
