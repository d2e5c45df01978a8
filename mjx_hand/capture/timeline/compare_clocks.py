"""The timeline of a recording from all that says when its rows were taken: times, frame numbers, the stated rate.

None is believed alone. Times and the rate agree where most steps are one frame long: then the rate is exact, and longer
steps are gaps. Times of another rate overrule a stated one within a fifth of it (a camera's nominal rate), else the
file is refused. Frame numbers that count rows say nothing; others have to agree with the times.
"""

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.timeline.clock_names import UNITS, unit_in
from mjx_hand.capture.timeline.row_order import RowOrder, row_order
from mjx_hand.capture.timeline.time_units import frame_step, near_equal, rates_by_unit, seconds_of
from mjx_hand.capture.timeline.timeline import Timeline, interpolated, placed, rounding
from mjx_hand.errors import InputError

Array = np.ndarray

STEADY = 0.45  # frames by which times may be off frames in a row; a frame left out makes half a frame
ON_FRAMES = 0.05  # frames by which times are off their frames that are not rounded more coarsely than to frames
ONE = 1.6  # frames: a longer step has a gap in it
NOMINAL, SAME = 0.2, 0.02  # shares by which measured and stated rates may differ: a nominal rate, and the same one
FEW = 0.1  # least share of steps of one frame, for the rate to be confirmed by them
LATEST = 1e20  # no clock says more: ns since 1970 are 2e18
NO_TWINS = np.zeros((0, 2), int)


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


def timeline_of(
    path: object,
    rows: int,
    *,
    rate: float | None = None,
    times: Float[Array, "t"] | None = None,
    name: str = "time",
    numbers: Float[Array, "t"] | None = None,
) -> Timeline:
    """The even frames of a recording of so many rows.

    Args:
        path: for messages.
        rows: how many there are.
        rate: frames per second that the file states, if it does.
        times: of the rows, in any unit; None, or the same everywhere, where it has none.
        name: of the times in the file, which may say their unit.
        numbers: of the frames that the rows are.

    Raises:
        InputError: there are no rows, or stamps are not finite, not in order, contradict each other, or leave gaps
            many times longer than the recording.
    """
    if not rows:
        raise InputError(f"{path}: the recording has no frames; save at least one")
    if rate is not None and not (np.isfinite(rate) and rate > 0):
        raise InputError(f"{path}: fps is {rate}, expected a positive number")
    times, numbers = _told(path, times, name), _told(path, numbers, "frame number")
    if numbers is not None and (numbers != np.rint(numbers)).any():
        raise InputError(f"{path}: frame {_first(numbers != np.rint(numbers))}'s number is not a whole one")
    if times is not None and rate is not None and _counts(times) and unit_in(name) is None and rate > 1 / (1 - NOMINAL):
        times, numbers = None, times if numbers is None else numbers  # 0, 1, 2, … beside a rate are no seconds
    if times is None:
        return _by_numbers(path, rows, rate, numbers)
    if rate is not None:
        return _by_rate(path, rate, times, name, numbers)
    seconds = seconds_of(path, times, name)
    near = near_equal(np.diff(times if seconds is None else seconds)) if seconds is not None else 0.0
    order = row_order(path, times if seconds is None else seconds, near, "time")
    stamps = (times if seconds is None else seconds)[order.kept]
    if len(stamps) < 2:
        return placed(path, order.kept, np.zeros(len(stamps)), None, order.twins, order.notes)
    frames = _frames_of_numbers(path, order, stamps, numbers)
    if frames is not None:
        fps = float(frames[-1] / (stamps[-1] - stamps[0]))
        found = placed(path, order.kept, frames, fps, order.twins, order.notes)
    else:
        found = interpolated(path, order.kept, stamps, order.twins, order.notes)
    if seconds is not None:
        return found
    # The unit is not told, but in any of them these are the frames.
    notes = (*found.notes, f"the unit of the times is not told: they would be {rates_by_unit(stamps)}")
    return Timeline(None, found.before, found.after, found.share, found.gap, found.twins, notes)


def _told(path: object, stamps: Float[Array, "t"] | None, what: str) -> Float[Array, "t"] | None:
    """Stamps that say something: finite, and not the same everywhere."""
    if stamps is None:
        return None
    stamps = np.asarray(stamps, dtype=float)
    if np.isnan(stamps).all():
        return None
    wrong = ~(np.abs(stamps) < LATEST)  # NaN too
    if wrong.any():
        at = _first(wrong)
        raise InputError(f"{path}: frame {at}'s {what} is {stamps[at]}; correct it, or leave out that frame")
    return None if len(stamps) > 1 and np.ptp(stamps) == 0 else stamps


def _first(bad: Array) -> int:
    return int(np.flatnonzero(bad)[0])


def _counts(stamps: Float[Array, "t"]) -> bool:
    """Whether stamps count frames: whole numbers, most of them one after the other."""
    steps = np.diff(stamps)
    return bool(len(steps)) and not (stamps != np.rint(stamps)).any() and float(np.median(steps)) == 1


def _by_numbers(path: object, rows: int, rate: float | None, numbers: Float[Array, "t"] | None) -> Timeline:
    """Rows without times: frames in a row, or with the gaps that their numbers leave."""
    if numbers is None:
        return placed(path, np.arange(rows), np.arange(rows), rate, NO_TWINS)
    order = row_order(path, numbers, 0.0, "number")
    frames = numbers[order.kept] - numbers[order.kept[0]]
    steps = np.diff(frames)
    stride = float(steps[0]) if len(steps) and (steps == steps[0]).all() else 1.0
    notes = order.notes
    if stride > 1 and rate is not None:
        notes = (*notes, f"frame numbers go up by {stride:g}, so that of {rate:g} frames/s {rate / stride:g} are there")
        rate = rate / stride
    return placed(path, order.kept, frames / stride, rate, order.twins, notes)


def _by_rate(
    path: object, rate: float, times: Float[Array, "t"], name: str, numbers: Float[Array, "t"] | None
) -> Timeline:
    """Rows with times, of a file that states its rate: the unit of the times is the one in which both agree."""
    named = unit_in(name)
    units = [named] if named else list(UNITS)
    for unit in units:
        if _in_a_row(times * UNITS[unit], rate):
            order = RowOrder(np.arange(len(times)), NO_TWINS, ())
            _check_numbers(path, order, np.arange(len(times), dtype=float), numbers)
            return placed(path, order.kept, order.kept, rate, NO_TWINS)
    for unit in units:
        seconds = times * UNITS[unit]
        near = min(near_equal(np.diff(seconds)), 0.5 / rate)
        order = row_order(path, seconds, near, "time")
        steps = np.diff(seconds[order.kept]) * rate
        single = steps[steps < ONE]
        if len(single) < FEW * len(steps) or not len(single) or abs(single.mean() - 1) > NOMINAL:
            continue
        frames = np.concatenate([[0], np.cumsum(np.maximum(np.rint(steps / single.mean()), 1))])
        measured = float(frames[-1] / (seconds[order.kept[-1]] - seconds[order.kept[0]]))
        notes = order.notes
        if abs(measured / rate - 1) > NOMINAL:
            break
        if abs(measured / rate - 1) > SAME:
            notes = (*notes, f"states {rate:g} frames/s, but its times are {measured:.4g}/s, which is believed")
        else:
            measured = rate
        _check_numbers(path, order, frames, numbers)
        return placed(path, order.kept, frames, measured, order.twins, notes)
    seconds = seconds_of(path, times, name)
    step = 0.0 if seconds is None else frame_step(seconds)[0]
    told = f"{1 / step:.4g} a second" if step > 0 else "in no unit that gives it"
    raise InputError(
        f"{path}: states {rate:g} frames per second, but its times are {told}; correct one of them, or leave one out"
    )


def _in_a_row(seconds: Float[Array, "t"], rate: float) -> bool:
    """Whether rows are frames one after the other at this rate, by their times, which may be rounded coarsely."""
    ticks = (seconds - seconds[0]) * rate
    off = np.ptp(ticks - np.arange(len(ticks))) / 2
    if off <= STEADY:
        return True
    rounded = np.abs(ticks - np.rint(ticks)).max() > ON_FRAMES
    return bool(rounded and off <= 1.05 * rounding(seconds) * rate)


def _frames_of_numbers(
    path: object, order: RowOrder, seconds: Float[Array, "k"], numbers: Float[Array, "t"] | None
) -> Array | None:
    """The frames that numbers say, where times grow evenly with them; else None, and the times decide.

    Raises:
        InputError: numbers and times contradict each other.
    """
    if numbers is None or _counts_rows(order, numbers):
        return None
    frames = numbers[order.kept] - numbers[order.kept[0]]
    if (np.diff(frames) > 0).all():
        mean = (seconds[-1] - seconds[0]) / frames[-1]
        if np.abs((seconds - seconds[0]) / mean - frames).max() <= 1:
            return frames
    _check_numbers(path, order, (seconds - seconds[0]) / np.median(np.diff(seconds)), numbers)
    return None


def _counts_rows(order: RowOrder, numbers: Float[Array, "t"]) -> bool:
    """Whether numbers only count the rows, which says nothing of when they were taken."""
    steps = np.diff(numbers[order.kept])
    return not len(steps) or (steps[0] > 0 and bool((steps == steps[0]).all()))


def _check_numbers(path: object, order: RowOrder, frames: Float[Array, "k"], numbers: Float[Array, "t"] | None) -> None:
    """Refuse frame numbers that do not grow, or leave frames out where the times do not.

    Raises:
        InputError: they are such.
    """
    if numbers is None or _counts_rows(order, numbers):
        return
    steps, passed = np.diff(numbers[order.kept]), np.diff(frames)
    bad = (steps <= 0) | ((steps > 1) & (passed < steps / 2))
    if not bad.any():
        return
    at = _first(bad)
    raise InputError(
        f"{path}: frame numbers and times contradict each other: at frame {order.kept[at + 1]} the number grows by "
        f"{steps[at]:g} and the time by {passed[at]:.3g} frames; correct one of them, or leave one out"
    )
