"""Frame times as devices write them: in one of several units, and not always even."""

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.motion.resample import interpolation_index

Array = np.ndarray

EVEN = 0.1  # share of a frame by which steps may differ and still be one rate
DROPPED = 1.5  # frames: a longer step is a gap


def stated_rate(path: object, name: str, value: object) -> float:
    """The frames per second that a file says, as a number or as text.

    Raises:
        InputError: it is no number.
    """
    try:
        if not isinstance(value, bool):
            return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        pass
    raise InputError(f"{path}: {name} is {value!r}, expected frames per second, such as 30")


def in_seconds(times: Float[Array, "t"]) -> Float[Array, "t"]:
    """Times in seconds, whose unit (s, ms, us or ns) is told by the step: hands are recorded at 1 to 1000 frames/s."""
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    scale = next((unit for unit in (1.0, 1e-3, 1e-6, 1e-9) if 1e-3 <= step * unit <= 1.0), 1.0)
    return times * scale


def evenly(
    path: object, times: Float[Array, "t"], positions: Float[Array, "t *d"]
) -> tuple[float | None, Float[Array, "n *d"]]:
    """The frame rate (None for a single frame), and the positions at that rate.

    Where steps differ, the rate is that of the median step and positions are interpolated on straight lines; across
    dropped frames they are NaN.

    Raises:
        InputError: times are not finite, or do not grow.
    """
    if len(times) < 2:
        return None, positions
    times = in_seconds(times)
    steps = np.diff(times)
    if not np.isfinite(times).all() or (steps <= 0).any():
        frame = int(np.flatnonzero(~(steps > 0))[0]) + 1
        raise InputError(f"{path}: frame {frame}'s time is not after the one before; sort the frames by time")
    step = float(np.median(steps))
    if np.abs(steps - step).max() <= EVEN * step:
        return (len(times) - 1) / float(times[-1] - times[0]), positions
    query = times[0] + step * np.arange(int((times[-1] - times[0]) / step + EVEN) + 1)
    before, after, fraction = interpolation_index(times, query)
    share = fraction.reshape(-1, *(1,) * (positions.ndim - 1))
    out = (1 - share) * positions[before] + share * positions[after]
    # On a frame itself nothing is missing, even beside a gap.
    out = np.where(share < EVEN, positions[before], np.where(share > 1 - EVEN, positions[after], out))
    dropped = (times[after] - times[before] > DROPPED * step) & (fraction >= EVEN) & (fraction <= 1 - EVEN)
    out[dropped] = np.nan
    return 1 / step, out
