"""Which lines of a table are one frame, whose hand each is of, and when the frames were taken."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mjx_hand.capture.keypoint_frames.assemble import Clock
from mjx_hand.capture.keypoint_frames.frame_hand import FrameHand
from mjx_hand.capture.keypoints.recording import SIDES
from mjx_hand.capture.keypoints.times import stated_rate
from mjx_hand.errors import InputError
from mjx_hand.files.delimited import Table

_TIMES = ("time", "t", "timestamp", "time_s", "time_ms", "timestamp_ms")
_NUMBERS = ("frame", "frame_number", "frame_id", "frame_index", "frame_idx")
_MIRRORED = ("handedness", "label")
_HANDS = ("hand", "side", *_MIRRORED, "hand_side", "hand_id", "hand_index")
_MOST_GAPS = 100  # frame numbers may leave out so many times what they name


def is_clock(column: str) -> bool:
    """Whether a column says which frame a line is of."""
    return column.lower() in (*_TIMES, *_NUMBERS)


def hand_column(columns: Sequence[str]) -> int | None:
    """The column that says whose hand a line is of."""
    lower = [column.lower().replace(" ", "_") for column in columns]
    return next((lower.index(name) for name in _HANDS if name in lower), None)


def hand_in(column: str, cell: str) -> tuple[str, str]:
    """Side and label of the hand that a line is of; `handedness` only names it, for MediaPipe's is a mirrored one."""
    text = cell.lower()
    side = next((side for side in SIDES if text in (side, side[0], f"{side}_hand", f"{side} hand")), "")
    return "" if column.lower() in _MIRRORED else side, side or text[:40]


def frames_of_rows(
    path: Path, table: Table, rows: Sequence[Sequence[str]], hands: Sequence[Sequence[FrameHand]]
) -> tuple[list[list[FrameHand]], Clock]:
    """The hands in each frame, and when the frames were taken.

    Lines of one time or frame number are one frame, where they are of different hands.

    Args:
        path: for messages.
        table: of the rows.
        rows: their cells.
        hands: in each of them.
    """
    rate = stated_rate(path, "fps", table.said["fps"]) if "fps" in table.said else None
    lower = [column.lower() for column in table.columns]
    time, number = (next((lower.index(n) for n in names if n in lower), None) for names in (_TIMES, _NUMBERS))
    if time is not None and rows and not _is_number(rows[0][time]):
        time = None  # a date, which says nothing here
    column = number if number is not None else time
    several = len({hand.label for own in hands for hand in own}) > 1 and column is not None
    groups: dict[str, list[int]] = {}
    for k, row in enumerate(rows):
        groups.setdefault(row[column] if several and column is not None else str(k), []).append(k)
    order = list(groups)
    if several and all(map(_is_number, order)):
        order = sorted(order, key=lambda cell: float(cell.replace(",", ".")))
    frames = [[hand for k in groups[cell] for hand in hands[k]] for cell in order]
    first = [groups[cell][0] for cell in order]
    kept = [rows[k] for k in first]
    times = None if time is None else table.numbers(kept, [time])[:, 0]
    if number is not None:
        numbers = table.numbers(kept, [number])[:, 0]
        if times is None and np.isfinite(numbers).all():
            frames = _with_gaps(path, frames, numbers)
    return frames, Clock(rate, times if rate is None else None, name="" if time is None else table.columns[time])


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _with_gaps(path: Path, frames: list[list[FrameHand]], numbers: np.ndarray) -> list[list[FrameHand]]:
    """Frames at their numbers, with nothing in those that are left out."""
    steps = np.diff(numbers)
    if len(steps) and (steps == steps[0]).all() and steps[0] > 0:
        return frames
    rows = (numbers - numbers[0]).astype(int)
    if (steps <= 0).any() or rows[-1] > _MOST_GAPS * len(rows):
        raise InputError(f"{path}: frame numbers do not grow, or leave most of them out; sort the lines by frame")
    made: list[list[FrameHand]] = [[] for _ in range(int(rows[-1]) + 1)]
    for row, frame in zip(rows, frames, strict=True):
        made[row] = frame
    return made
