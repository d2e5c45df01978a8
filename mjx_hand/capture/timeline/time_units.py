"""The unit of time stamps, from their name, their size, or the rate that they would give."""

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.timeline.clock_names import UNITS, unit_in
from mjx_hand.errors import InputError

Array = np.ndarray

FASTEST, SLOWEST = 1000.0, 1.0  # frames/s at which hands are recorded
COMMON = (5.0, 250.0)  # frames/s of nearly all recordings
SLACK = 1.1  # by which a rate may be beyond these: stamps are rounded
NEAR = 0.005  # s: stamps closer than this, and five times closer than others are, are of one frame
NEAR_RATIO = 5.0
OFTEN = 0.2  # share of the steps that must be longer, for the shorter ones to be within a frame
_CLOCK = (1.0e9, 4.1e9)  # s since 1970: from 2001 to 2099


def near_equal(steps: Float[Array, "s"]) -> float:
    """The longest step (s) between stamps of one and the same frame; 0 where there are none but equal ones.

    Two cameras, or two callbacks a frame, stamp in pairs: their steps are of two sizes with nothing between.
    """
    ordered = np.sort(steps[steps > 0])
    if len(ordered) < 2:
        return 0.0
    ratio = ordered[1:] / ordered[:-1]
    longer = np.arange(len(ordered) - 1, 0, -1) / len(ordered)
    apart = (ratio >= NEAR_RATIO) & (longer >= OFTEN) & (ordered[:-1] <= NEAR)
    return float(ordered[:-1][apart].max()) if apart.any() else 0.0


def frame_step(seconds: Float[Array, "t"]) -> tuple[float, bool]:
    """The usual time (s) from frame to frame, near-equal stamps being one, and whether most steps are like it."""
    steps = np.diff(seconds)
    between = steps[steps > near_equal(steps)]
    if not len(between):
        return 0.0, False
    step = float(np.median(between))
    return step, bool((between <= 3 * step).mean() >= 1 - OFTEN)


def seconds_of(path: object, times: Float[Array, "t"], name: str) -> Float[Array, "t"] | None:
    """Time stamps in seconds; None where their unit cannot be told.

    The name says the unit (`timestamp_ms`), else the size of a clock's time since 1970, else the rate: of the units
    that give 1 to 1000 frames/s the one that gives a common rate, evenly.

    Raises:
        InputError: the unit in the name gives a rate at which nobody records.
    """
    if len(times) < 2 or not np.ptp(times) > 0:
        return times * UNITS.get(unit_in(name) or "s", 1.0)
    named = unit_in(name)
    steps = {unit: frame_step(times * scale) for unit, scale in UNITS.items()}
    possible = [unit for unit, (step, _) in steps.items() if 1 / (SLACK * FASTEST) <= step <= SLACK / SLOWEST]
    if named is not None:
        step = steps[named][0]
        if 0.5 / FASTEST <= step <= 60:
            return times * UNITS[named]
        rate = f"{1 / step:.3g} frames a second" if step > 0 else "no rate"
        other = f"; in {possible[0]} it would be {1 / steps[possible[0]][0]:.3g}" if possible else ""
        raise InputError(f"{path}: {name!r} in {named} gives {rate}{other}; name the times by their unit")
    middle = float(np.median(np.abs(times)))
    of_clock = [unit for unit in possible if _CLOCK[0] <= middle * UNITS[unit] <= _CLOCK[1]]
    if of_clock:
        return times * UNITS[of_clock[0]]
    if not possible:
        return times
    score = {unit: _score(*steps[unit]) for unit in possible}
    best = [unit for unit in possible if score[unit] == max(score.values())]
    return times * UNITS[best[0]] if len(best) == 1 else None


def rates_by_unit(times: Float[Array, "t"]) -> str:
    """The rates, in words, that each unit would give to times, of those at which hands are recorded."""
    rates = {unit: 1 / frame_step(times * scale)[0] for unit, scale in UNITS.items()}
    return ", ".join(f"{r:.4g}/s in {u}" for u, r in rates.items() if SLOWEST / SLACK <= r <= SLACK * FASTEST)


def _score(step: float, even: bool) -> tuple[bool, bool]:
    return COMMON[0] <= 1 / step <= COMMON[1], even
