"""Which lines of a table are one frame, whose hand each is of, and when the frames were taken."""

from collections.abc import Sequence
from pathlib import Path

from mjx_hand.capture.keypoint_frames.frame_hand import FrameHand
from mjx_hand.capture.keypoints.recording import SIDES
from mjx_hand.capture.timeline.clock_names import names_numbers, names_time
from mjx_hand.capture.timeline.compare_clocks import stated_rate, timeline_of
from mjx_hand.capture.timeline.timeline import Timeline
from mjx_hand.files.delimited import Table

_CLOCKS = (names_time, names_numbers)
_MIRRORED = ("handedness", "label")
_HANDS = ("hand", "side", *_MIRRORED, "hand_side", "hand_id", "hand_index")


def is_clock(column: str) -> bool:
    """Whether a column says which frame a line is of."""
    return any(named(column) for named in _CLOCKS)


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
) -> tuple[list[list[FrameHand]], Timeline]:
    """The hands in each frame, and when the frames were taken.

    Lines of one time or frame number are one frame, where they are of different hands.

    Args:
        path: for messages.
        table: of the rows.
        rows: their cells.
        hands: in each of them.
    """
    time, number = (next((k for k, c in enumerate(table.columns) if named(c)), None) for named in _CLOCKS)
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
    timeline = timeline_of(
        path,
        len(kept),
        rate=stated_rate(path, "fps", table.said["fps"]) if "fps" in table.said else None,
        times=None if time is None else table.stamps(kept, time),
        name="" if time is None else table.columns[time],
        numbers=None if number is None else table.stamps(kept, number),
    )
    return frames, timeline


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True
