"""Newest wins; times of hours in memory that does not grow."""

import json
import threading
import time

import numpy as np

from envs.live.flow.histogram import Histogram
from envs.live.flow.newest import Newest
from envs.live.flow.timing import STAGES, Timing
from envs.live.real_time import Pace


def test_quantiles_are_those_of_the_times_to_a_twentieth():
    times = np.random.default_rng(0).lognormal(-5.0, 1.0, 20_000)
    histogram = Histogram()
    for seconds in times:
        histogram.add(float(seconds))
    for share in (0.5, 0.99):
        exact = np.quantile(times, share)
        assert exact <= histogram.quantile(share) <= 1.06 * exact
    assert histogram.largest == times.max()
    assert histogram.quantile(1.0) == times.max()


def test_odd_times_are_counted_and_break_nothing():
    histogram = Histogram()
    assert histogram.quantile(0.5) == 0.0
    for seconds in (-1.0, 0.0, 1e9):
        histogram.add(seconds)
    assert histogram.count == 3
    assert histogram.quantile(0.1) <= 1e-6
    assert len(histogram._bins) == len(Histogram()._bins)


def test_only_the_newest_is_taken_and_the_rest_is_counted():
    newest: Newest[int] = Newest()
    for k in range(200):
        newest.put(k)
    assert newest.take() == 199
    assert newest.take() is None
    assert newest.replaced == 199


def test_who_waits_is_woken():
    newest: Newest[str] = Newest()
    threading.Timer(0.05, lambda: newest.put("there")).start()
    assert newest.take(10.0) == "there"


def test_the_report_is_json_and_notices_of_strangers_do_not_grow_it():
    timing = Timing()
    timing.add("wire", 0.0123)
    for k in range(1000):
        timing.say(f"notice {k}")
    report = json.loads(json.dumps(timing.report()))
    assert set(report["stages_ms"]) == set(STAGES)
    assert report["stages_ms"]["wire"]["max"] == 12.3
    assert len(report["notices"]) <= 32
    assert timing.notice == "notice 999"


def test_steps_take_real_time_without_drift_and_a_machine_that_stood_still_is_said():
    timing = Timing()
    pace, began = Pace(0.004, timing), time.monotonic()
    for k in range(250):
        pace.wait()
        assert time.monotonic() - began >= 0.004 * (k + 1) - 1e-3  # none is early
        if k % 50 == 10:
            time.sleep(0.03)  # made up for in the next steps
    assert time.monotonic() - began < 1.2
    assert timing.counts["seconds_skipped"] == 0
    assert timing.stages["behind"].largest >= 0.025
    time.sleep(0.4)
    pace.wait()
    began = time.monotonic()
    for _ in range(25):
        pace.wait()
    assert time.monotonic() - began > 0.09  # what was missed is not made up for in a rush
    assert timing.counts["seconds_skipped"] > 0.3
    assert "stood still" in timing.notice
