"""`Timeline`: the even frames of a recording whose rows are stamped with times, frame numbers, or nothing."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mjx_hand.errors import InputError
from mjx_hand.motion.resample import interpolation_index

Array = np.ndarray

EVEN = 0.1  # share of a frame by which steps may differ and still be one rate
HALF = 0.5  # frame by which a rounded time may be off its frame
DROPPED = 1.5  # frames: a longer step is a gap
# A recording may have so many times more frames than rows, but no more than so many added ones; and always so many.
MOST_TIMES, MOST_ADDED, ALWAYS = 100, 300_000, 10_000


@dataclass(frozen=True)
class Timeline:
    """Even frames, and the rows that they are made of.

    Attributes:
        fps: frames per second; None where nobody has said.
        before, after: of each frame the rows around it, which are one where a row is the frame.
        share: of the row after it.
        gap: frames without a row.
        twins: rows that repeat a frame: the row that is kept, and the one that fills in what it lacks.
        notes: what was left out or overruled, for people.
    """

    fps: float | None
    before: Int[Array, "n"]
    after: Int[Array, "n"]
    share: Float[Array, "n"]
    gap: Bool[Array, "n"]
    twins: Int[Array, "k 2"]
    notes: tuple[str, ...] = ()

    def sampled(self, values: Float[Array, "t *d"]) -> Float[Array, "n *d"]:
        """The rows' values at the even frames: on straight lines between rows, NaN in gaps."""
        rows = np.array(values, dtype=float)
        for kept, twin in self.twins:
            rows[kept] = np.where(np.isnan(rows[kept]), rows[twin], rows[kept])
        share = self.share.reshape(-1, *(1,) * (rows.ndim - 1))
        out = (1 - share) * rows[self.before] + share * rows[self.after]
        # On a frame itself nothing is missing, even beside a gap.
        out = np.where(share < EVEN, rows[self.before], np.where(share > 1 - EVEN, rows[self.after], out))
        out[self.gap] = np.nan
        return out


def placed(
    path: object,
    rows: Int[Array, "k"],
    frames: Float[Array, "k"] | Int[Array, "k"],
    fps: float | None,
    twins: Int[Array, "j 2"],
    notes: tuple[str, ...] = (),
) -> Timeline:
    """Rows that are frames of these numbers, which grow from 0; frames between them are gaps.

    Raises:
        InputError: the gaps would be many times longer than the recording.
    """
    check_span(path, rows, frames, fps)
    frames = np.rint(frames).astype(int)
    count = int(frames[-1]) + 1
    row = np.full(count, rows[0])
    row[frames] = rows
    gap = np.ones(count, bool)
    gap[frames] = False
    return Timeline(fps, row, row, np.zeros(count), gap, twins, notes)


def interpolated(
    path: object,
    rows: Int[Array, "k"],
    seconds: Float[Array, "k"],
    twins: Int[Array, "j 2"],
    notes: tuple[str, ...] = (),
) -> Timeline:
    """Rows at growing times (s), which alone give the rate.

    Where steps differ, the rate is that of the median step, and frames lie on straight lines between rows; across
    dropped rows they are gaps.

    Raises:
        InputError: the gaps would be many times longer than the recording.
    """
    steps = np.diff(seconds)
    step, span = float(np.median(steps)), float(seconds[-1] - seconds[0])
    frames = np.concatenate([[0], np.cumsum(np.maximum(np.rint(steps / step), 1))])
    check_span(path, rows, frames, 1 / step)
    mean = span / float(frames[-1])
    off = max(EVEN, min(2.1 * rounding(seconds) / mean, HALF))  # twice: the ends, of which the mean is, are rounded too
    if np.abs((seconds - seconds[0]) / mean - frames).max() <= off or np.abs(steps - step).max() <= EVEN * step:
        return placed(path, rows, frames, 1 / mean, twins, notes)
    query = seconds[0] + step * np.arange(int(span / step + EVEN) + 1)
    before, after, share = interpolation_index(seconds, query)
    gap = (seconds[after] - seconds[before] > DROPPED * step) & (share >= EVEN) & (share <= 1 - EVEN)
    return Timeline(1 / step, rows[before], rows[after], share, gap, twins, notes)


def rounding(seconds: Float[Array, "t"]) -> float:
    """By how much (s) times are rounded, where all are whole tenths, hundredths, … of a second; else 0."""
    for digits in range(1, 5):
        scaled = seconds * 10**digits
        if np.abs(scaled - np.rint(scaled)).max() < 1e-3:
            return 0.5 / 10**digits
    return 0.0


def check_span(
    path: object, rows: Int[Array, "k"], frames: Float[Array, "k"] | Int[Array, "k"], fps: float | None
) -> None:
    """Refuse gaps that are many times longer than what was recorded, such as a clock that was set once.

    Raises:
        InputError: they are.
    """
    added = float(frames[-1]) + 1 - len(rows)
    if added <= max(ALWAYS, min(MOST_TIMES * len(rows), MOST_ADDED)):
        return
    at = int(np.argmax(np.diff(frames)))
    wide = float(frames[at + 1] - frames[at])
    long = f"{wide:.4g} frames" + (f" ({wide / fps:.4g} s)" if fps else "")
    raise InputError(
        f"{path}: frame {rows[at + 1]} is {long} after the one before, and the file has {len(rows)}; "
        "correct that frame's stamp, or split the recording there"
    )
