"""Keypoints as a table: a header of `NAME_x,NAME_y,NAME_z` columns (or `x0,y0,z0,x1,…`), one line per frame.

Columns `time`, `t` or `timestamp` (`time_ms` says a unit) and `frame` say when lines were taken. Lines before the
header may say `# fps: 30`, `# unit: mm`, `# side: left` or `# layout: leap_bones`. Names that begin with `left_` or
`right_` belong to that hand; a column `hand`, `side` or `handedness` says which hand a line is of, and two hands of one
time or frame are two lines. Empty cells and `nan` are gaps; columns that are none of these are passed over.
"""

import re
from pathlib import Path
from typing import Any

from mjx_hand.capture.keypoint_files.reader import TABLE, KeypointReader
from mjx_hand.capture.keypoint_frames.assemble import recordings
from mjx_hand.capture.keypoint_frames.frame_hand import FrameHand
from mjx_hand.capture.keypoint_frames.table_clock import frames_of_rows, hand_column, hand_in, is_clock
from mjx_hand.capture.keypoints.names import names_a_hand
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.errors import InputError

_HAND = re.compile(r"(right|left)(?:[_. :-]?hand)?[_. :-](.+)", re.IGNORECASE)
_NAMED = re.compile(r"(.+?)[_. :-]?([xyz])", re.IGNORECASE)
_COUNTED = re.compile(
    r"([xyz])_?(\d+)|(?:landmark|keypoint|joint|point|lm|kp|p)?[_. ]?(\d+)[_. ]?([xyz])", re.IGNORECASE
)
_FEWEST = 19  # counted points that may be a hand's

Columns = dict[str, dict[str, list[int]]]  # hand, joint: the columns of x, y and z


def _columns(header: tuple[str, ...]) -> Columns:
    found: Columns = {}
    for column, cell in enumerate(header):
        hand = _HAND.fullmatch(cell)
        side, rest = (hand[1].lower(), hand[2]) if hand else ("", cell)
        counted, named = _COUNTED.fullmatch(rest), _NAMED.fullmatch(rest)
        if is_clock(cell) or not (counted or named):
            continue
        if counted:
            axis, joint = (counted[1], counted[2]) if counted[1] else (counted[4], counted[3])
        else:
            joint, axis = named.groups() if named else ("", "")
        found.setdefault(side, {}).setdefault(joint, [-1, -1, -1])["xyz".index(axis.lower())] = column
    return found


def _counted(joints: dict[str, list[int]]) -> bool:
    return all(joint.isdigit() for joint in joints)


def _hands(header: tuple[str, ...]) -> Columns:
    """The columns of hands alone: of other things in the table nothing is asked."""
    return {
        side: joints
        for side, joints in _columns(header).items()
        if names_a_hand(list(joints)) or (_counted(joints) and len(joints) > _FEWEST)
    }


def _recognises(table: Any) -> bool:
    return bool(_hands(table.columns))


def _read(path: Path, table: Any, unit: str | None) -> dict[str, KeypointRecording]:
    repeated = table.repeated()
    if repeated:
        raise InputError(f"{path}: columns repeat: {', '.join(repeated[:6])}; give each its own name")
    rows = table.rows()
    label = hand_column(table.columns)
    listed: list[list[FrameHand]] = [[] for _ in rows]
    for side, joints in _hands(table.columns).items():
        short = [joint for joint, columns in joints.items() if -1 in columns]
        if short:
            raise InputError(f"{path}: {', '.join(short[:6])} lacks one of its x, y and z columns")
        names = sorted(joints, key=int) if _counted(joints) else list(joints)
        points = table.numbers(rows, [column for name in names for column in joints[name]])
        told = () if _counted(joints) else tuple(names)
        for row, own, place in zip(rows, listed, points.reshape(len(rows), len(names), 3), strict=True):
            which, name = (side, side) if side or label is None else hand_in(table.columns[label], row[label])
            own.append(FrameHand(place, told, which, name))
    frames, timeline = frames_of_rows(path, table, rows, listed)
    return recordings(path, frames, timeline, table.said, unit)


READER = KeypointReader(
    name="keypoint tables (NAME_x, NAME_y, NAME_z columns)", container=TABLE, recognises=_recognises, read=_read
)
