"""Timing contestants in turns, so that a machine whose speed drifts treats all of them alike."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from train.benchmark.contestants import Contestant


@dataclass(frozen=True)
class Rate:
    """Control steps a second of all worlds together, over several runs."""

    median: float
    least: float
    greatest: float

    @classmethod
    def of(cls, rates: Sequence[float]) -> "Rate":
        """The rate that these runs make."""
        return cls(float(np.median(rates)), float(min(rates)), float(max(rates)))


def rates(
    contestants: Sequence[Contestant],
    runs: int,
    seconds: float,
    report: Callable[[int], None] = lambda done: None,
) -> list[Rate]:
    """Each contestant's rate over `runs` runs of about `seconds`; every round has one run of each.

    Args:
        contestants: what to time.
        runs: how many timed runs each.
        seconds: how long a run of each should last; a run has at least one unit of steps.
        report: called after each timed run with the number of runs it was: 1.
    """
    steps = [enough_steps(c, seconds) for c in contestants]
    measured: list[list[float]] = [[] for _ in contestants]
    for _ in range(runs):
        for contestant, count, kept in zip(contestants, steps, measured, strict=True):
            kept.append(rate_once(contestant, count))
            report(1)
    return [Rate.of(kept) for kept in measured]


def rate_once(contestant: Contestant, steps: int) -> float:
    """Control steps a second of all worlds in one run of `steps` steps each."""
    started = time.perf_counter()
    contestant.advance(steps)
    return steps * contestant.worlds / (time.perf_counter() - started)


def enough_steps(contestant: Contestant, seconds: float) -> int:
    """Steps that last about `seconds`, found by ever longer runs, which also warm the contestant up."""
    contestant.advance(contestant.unit)
    units = 1
    while True:
        started = time.perf_counter()
        contestant.advance(units * contestant.unit)
        took = time.perf_counter() - started
        wanted = max(round(units * seconds / took), 1)
        if took > seconds / 4:
            return wanted * contestant.unit
        units = min(wanted, 8 * units)  # a short run says little
