import dataclasses
import time

import numpy as np
import pytest

from train.benchmark.gpu import physics
from train.benchmark.gpu.bench import Bench
from train.benchmark.gpu.budget import Budget
from train.benchmark.gpu.record import Record
from train.benchmark.gpu.scale import REHEARSAL


@pytest.fixture
def bench(tmp_path, demonstrations):
    return Bench(REHEARSAL, Budget.of(60.0, time.monotonic), "native", tmp_path, demonstrations)


def test_a_sweep_keeps_each_point_and_names_those_that_time_did_not_suffice_for(bench, monkeypatch):
    measured = []

    def point(bench, env, grasp, count):
        measured.append(count)
        bench.budget.clock.now += 20.0
        return (5.0 * count, 4.0 * count, 6.0 * count, 1.0 * count), (1.0, 2.0, None, None)

    class Clock:
        now = 0.0

        def __call__(self):
            return self.now

    monkeypatch.setattr(physics, "_point", point)
    bench = dataclasses.replace(bench, budget=Budget.of(1.0, Clock()))
    record, kept = Record("physics", ""), []
    physics.sweep(bench, "native", (8, 2, 32), record, lambda: kept.append(len(record.tables[0].rows)))
    assert measured == [8, 2]  # a third of up to 30 s does not fit into the last 20
    assert kept == [1, 2]
    assert record.left_out == ["pinch, native, 32 worlds"]
    assert record.tables[0].rows[1][:5] == ("pinch", "native", 2, 10.0, 8.0)
    assert list(record.figures) == ["physics-native"]


def test_a_point_is_physics_steps_of_all_worlds(bench):
    rate, (compiling, ready, peak, in_use) = physics._point(bench, bench.env("native", "pinch"), "pinch", 4)
    assert rate is not None
    assert compiling is not None
    assert ready is not None
    median, least, greatest, control = rate
    assert least <= median <= greatest
    assert median == pytest.approx(5 * control)
    assert 0 < compiling < ready
    assert peak is in_use is None
    assert ("native", "pinch", 4) in bench.contestants


def test_the_c_engine_agrees_with_itself_but_for_its_solver(bench):
    record = Record("agreement", "")
    physics.agreement(bench, "native", record, lambda: None)
    off = np.array([row[2] for row in record.tables[0].rows])
    np.testing.assert_array_equal(off, 0.0)  # the same models, settings included
    assert record.notes[0] == "native: within all limits."
