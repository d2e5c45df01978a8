"""Which rows of a recording are in order, and which are of one and the same frame."""

import bisect
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from mjx_hand.errors import InputError

Array = np.ndarray

ASTRAY = 0.02  # share of the rows that may be out of order and are left out; with more the file is not sorted


@dataclass(frozen=True)
class RowOrder:
    """The rows that are frames of their own.

    Attributes:
        kept: their numbers; what they are stamped with grows from each to the next.
        twins: rows that repeat a frame: the kept row, and the one that repeats it.
        notes: what was left out, for people.
    """

    kept: Int[Array, "k"]
    twins: Int[Array, "n 2"]
    notes: tuple[str, ...]


def row_order(path: object, stamps: Float[Array, "t"], near: float, what: str) -> RowOrder:
    """Rows by their stamps (times or frame numbers).

    Args:
        path: for messages.
        stamps: finite.
        near: stamps up to so much apart are of one frame.
        what: a stamp is called, such as "time".

    Raises:
        InputError: so many stamps go back that the rows are not in order.
    """
    notes = []
    rows = np.arange(len(stamps))
    if (np.diff(stamps) < 0).any():
        rows = _longest_growing(stamps)
        astray = np.setdiff1d(np.arange(len(stamps)), rows)
        if len(astray) > max(1, ASTRAY * len(stamps)):
            first = int(np.argmax(np.diff(stamps) < 0)) + 1
            raise InputError(
                f"{path}: frame {first}'s {what} is before the one before it, and {len(astray)} are out of order; "
                f"sort the frames by {what}, and give one recording per file"
            )
        notes.append(f"{_frames(len(astray))} left out whose {what} is before an earlier one's, first {astray[0]}")
    first = np.concatenate([[True], np.diff(stamps[rows]) > near])
    kept = rows[first]
    twins = np.stack([kept[np.cumsum(first) - 1], rows], axis=1)[~first]
    if len(twins):
        alike = "equal" if near == 0 else "equal or nearly equal"
        notes.append(f"{_frames(len(twins))} of {alike} {what} taken as one with the frame before, first {twins[0, 1]}")
    return RowOrder(kept, twins, tuple(notes))


def _frames(count: int) -> str:
    return f"{count} frame{'s' if count > 1 else ''}"


def _longest_growing(stamps: Float[Array, "t"]) -> Int[Array, "k"]:
    """The rows of the longest run of stamps that never go back (Schensted 1961), the rest being astray."""
    ends: list[float] = []  # the least last stamp of a run of each length
    rows: list[int] = []
    before = np.full(len(stamps), -1)
    for row, stamp in enumerate(stamps.tolist()):
        at = bisect.bisect_right(ends, stamp)
        before[row] = rows[at - 1] if at else -1
        ends[at : at + 1], rows[at : at + 1] = [stamp], [row]
    run = [rows[-1]]
    while before[run[-1]] >= 0:
        run.append(int(before[run[-1]]))
    return np.array(run[::-1])
