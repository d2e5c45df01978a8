"""Keypoints as a table: a header of `NAME_x,NAME_y,NAME_z` columns (or `x0,y0,z0,x1,…`), one line a frame.

A column `time`, `t` or `timestamp` (`time_ms` says a unit) and one of `frame` numbers are compared with the rate. Lines
before the header may say `# fps: 30`, `# unit: mm`, `# side: left` or `# layout: leap_bones`. Names that begin with
`left_` or `right_` belong to that hand. Empty cells and `nan` are gaps.
"""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.reader import KeypointReader
from mjx_hand.capture.keypoint_files.timed_hand import timed_hand
from mjx_hand.capture.keypoints.names import counted_keypoints, named_keypoints, names_a_hand
from mjx_hand.capture.keypoints.recording import SIDES, KeypointRecording
from mjx_hand.capture.keypoints.size import unit_factor
from mjx_hand.capture.timeline.clock_names import names_numbers, names_time
from mjx_hand.capture.timeline.compare_clocks import stated_rate, timeline_of
from mjx_hand.capture.timeline.timeline import Timeline
from mjx_hand.errors import InputError

_NAMED = re.compile(r"(.+?)[_. :-]?([xyzXYZ])")
_COUNTED = re.compile(r"([xyz])_?(\d+)")
_HAND = re.compile(r"(right|left)[_. :-](.+)", re.IGNORECASE)

Columns = dict[str, dict[str, list[int]]]  # hand, joint: the columns of x, y and z


def _header(lines: list[str]) -> tuple[dict[str, str], list[str], list[str]]:
    """What comment lines say, the column names, and the lines after them."""
    said: dict[str, str] = {}
    for k, line in enumerate(lines):
        if not line.startswith("#"):
            return said, [cell.strip().strip('"') for cell in line.split(",")], lines[k + 1 :]
        key, _, value = line.lstrip("# ").partition(":")
        said[key.strip().lower()] = value.strip()
    return said, [], []


def _columns(header: list[str]) -> Columns:
    found: Columns = {}
    for column, cell in enumerate(header):
        counted, named = _COUNTED.fullmatch(cell.lower()), _NAMED.fullmatch(cell)
        if names_time(cell) or not (counted or named):
            continue
        axis, joint = counted.groups() if counted else (named[2].lower(), named[1]) if named else ("", "")
        hand = _HAND.fullmatch(joint)
        side, joint = (hand[1].lower(), hand[2]) if hand else ("", joint)
        found.setdefault(side, {}).setdefault(joint, [-1, -1, -1])["xyz".index(axis)] = column
    return found


def _counted(joints: dict[str, list[int]]) -> bool:
    return all(joint.isdigit() for joint in joints)


def _recognises(lines: Any) -> bool:
    columns = _columns(_header(lines)[1])
    return any(names_a_hand(list(joints)) or (_counted(joints) and len(joints) > 19) for joints in columns.values())


def _read(path: Path, lines: Any, unit: str | None) -> dict[str, KeypointRecording]:
    said, header, rows = _header(lines)
    repeated = sorted(cell for cell, count in Counter(header).items() if count > 1)
    if repeated:
        raise InputError(f"{path}: columns repeat: {', '.join(repeated)}; give each its own name")
    table = np.full((len(rows), len(header)), np.nan)
    for k, row in enumerate(rows):
        cells = row.split(",")
        try:
            table[k] = [float(cell) if cell.strip() else np.nan for cell in cells]
        except ValueError:
            raise InputError(
                f"{path}: frame {k} has {len(cells)} cells of {len(header)}, or one that is no number"
            ) from None
    timeline = _timeline(path, said, header, table)
    table[~np.isfinite(table)] = np.nan
    factor = unit_factor(str(path), unit or said.get("unit") or "m")
    found = {}
    for side, joints in _columns(header).items():
        short = [joint for joint, columns in joints.items() if -1 in columns]
        if short:
            raise InputError(f"{path}: {', '.join(short)} lacks one of its x, y and z columns")
        names = sorted(joints, key=int) if _counted(joints) else list(joints)
        points = table[:, [joints[name] for name in names]] * factor
        if _counted(joints):
            positions, layout = counted_keypoints(path, points, said.get("layout"))
        else:
            positions, layout = named_keypoints(path, names, points)
        side = side or said.get("side", "").lower()
        found[side if side in SIDES else "hand"] = timed_hand(path, positions, timeline, side=side, layout=layout)
    return found


def _timeline(path: Path, said: dict[str, str], header: list[str], table: np.ndarray) -> Timeline:
    time, number = (next((k for k, c in enumerate(header) if named(c)), None) for named in (names_time, names_numbers))
    return timeline_of(
        path,
        len(table),
        rate=stated_rate(path, "fps", said["fps"]) if "fps" in said else None,
        times=None if time is None else table[:, time],
        name="" if time is None else header[time],
        numbers=None if number is None else table[:, number],
    )


READER = KeypointReader(
    name="keypoint tables (NAME_x, NAME_y, NAME_z columns)", suffix=".csv", recognises=_recognises, read=_read
)
