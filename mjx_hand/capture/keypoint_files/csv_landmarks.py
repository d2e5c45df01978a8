"""Keypoints as a table with a line for each landmark: `frame,hand,landmark,x,y,z`.

`landmark` (or `joint`, `keypoint`, `point`, `id`, `name`) is a joint's name or its number in the layout; `frame` or a
time says which lines belong together, a missing frame number is a gap; `hand` may be left out. Lines before the header
may say `# fps: 30`, `# unit: mm`, `# side: left` or `# layout: leap_bones`.
"""

from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.reader import TABLE, KeypointReader
from mjx_hand.capture.keypoint_frames.assemble import recordings
from mjx_hand.capture.keypoint_frames.frame_hand import FrameHand
from mjx_hand.capture.keypoint_frames.table_clock import frames_of_rows, hand_column, hand_in, is_clock
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.errors import InputError

_LANDMARK = ("landmark", "joint", "keypoint", "point", "landmark_id", "joint_id", "landmark_index", "joint_index",
             "landmark_name", "joint_name", "keypoint_id", "point_id", "id", "index", "name")  # fmt: skip
_MOST = 64  # landmarks of a hand in any layout


def _place(columns: tuple[str, ...], names: tuple[str, ...]) -> int | None:
    lower = [cell.lower().replace(" ", "_") for cell in columns]
    return next((lower.index(name) for name in names if name in lower), None)


def _axes(columns: tuple[str, ...]) -> list[int] | None:
    axes = [_place(columns, (axis, f"{axis}_m", f"{axis}_mm", f"world_{axis}", f"pos_{axis}", f"position_{axis}"))
            for axis in "xyz"]  # fmt: skip
    return None if None in axes else [axis for axis in axes if axis is not None]


def _recognises(table: Any) -> bool:
    return (
        _axes(table.columns) is not None
        and _place(table.columns, _LANDMARK) is not None
        and any(map(is_clock, table.columns))
    )


def _read(path: Path, table: Any, unit: str | None) -> dict[str, KeypointRecording]:
    if repeated := table.repeated():
        raise InputError(f"{path}: columns repeat: {', '.join(repeated[:6])}; give each its own name")
    rows = table.rows()
    landmark, axes, hand = _place(table.columns, _LANDMARK), _axes(table.columns), hand_column(table.columns)
    assert landmark is not None, "as recognised"
    assert axes is not None, "as recognised"
    points = table.numbers(rows, axes)
    clocks = [k for k, cell in enumerate(table.columns) if is_clock(cell)]
    # Lines of one frame and hand, wherever they stand.
    groups: dict[tuple[str, ...], dict[str, int]] = {}
    for k, row in enumerate(rows):
        key = (*(row[c] for c in clocks), row[hand] if hand is not None else "")
        own = groups.setdefault(key, {})
        if row[landmark] in own:
            raise InputError(f"{path}: frame {row[clocks[0]]} has landmark {row[landmark][:40]!r} twice; keep one")
        own[row[landmark]] = k
        if len(own) > _MOST:
            raise InputError(f"{path}: frame {row[clocks[0]]} has over {_MOST} landmarks; give one line to each joint")
    numbered = all(name.isdigit() for own in groups.values() for name in own)
    numbers = sorted({int(name) for own in groups.values() for name in own}) if numbered else []
    first, listed = [], []
    for own in groups.values():
        row = rows[next(iter(own.values()))]
        side, name = ("", "") if hand is None else hand_in(table.columns[hand], row[hand])
        if numbered:
            places = np.full((len(numbers), 3), np.nan)
            places[[numbers.index(int(each)) for each in own]] = points[list(own.values())]
        else:
            places = points[list(own.values())]
        listed.append([FrameHand(places, () if numbered else tuple(own), side, name)])
        first.append(row)
    frames, timeline = frames_of_rows(path, table, first, listed)
    return recordings(path, frames, timeline, table.said, unit)


READER = KeypointReader(
    name="keypoint tables (a line a landmark: frame, hand, landmark, x, y, z)",
    container=TABLE,
    recognises=_recognises,
    read=_read,
)
