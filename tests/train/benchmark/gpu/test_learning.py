import dataclasses
import time

import pytest

from train.benchmark.gpu import learning
from train.benchmark.gpu.bench import Bench
from train.benchmark.gpu.budget import Budget
from train.benchmark.gpu.record import Record
from train.benchmark.gpu.scale import REHEARSAL
from train.learning.curve import Point


@pytest.fixture
def bench(tmp_path, demonstrations):
    return Bench(REHEARSAL, Budget.of(60.0, time.monotonic), "native", tmp_path, demonstrations)


def moment(seconds, evaluating, success, steps=10):
    return learning.Moment(seconds, evaluating, Point(steps, seconds, success, 1.0, 9.0))


def test_the_story_tells_compiling_learning_and_evaluating_apart(bench, tmp_path):
    config = learning.gpu_config("pinch", REHEARSAL, tmp_path, tmp_path)
    moments = [moment(40.0, 12.0, 0.0), moment(50.0, 16.0, 0.5), moment(65.0, 20.0, 0.97, 4000)]
    points = [each.point for each in moments]
    story = learning._story(config, "warp", 3.0, moments, points, 0.95)
    assert "environment made in 3.0 s" in story
    assert "the first update and the first evaluation took 40.0 s" in story
    assert "after 65.0 s and 4,000 steps" in story
    assert "17.0 s of learning" in story
    assert "8.0 s of evaluations" in story
    assert "95% was not reached: 50% at best" in learning._story(config, "warp", 3.0, moments[:2], points[:2], 0.95)


@pytest.mark.parametrize(("name", "engine"), [("all", "native"), ("pinch", "warp")])
def test_the_engine_is_the_experiments_own_or_else_the_measured_one(bench, monkeypatch, tmp_path, name, engine):
    made, env = [], bench.env("native", "pinch")
    monkeypatch.setattr(learning, "training_env", lambda config: made.append(config.engine) or env)
    monkeypatch.setattr(learning, "make_missing_sets", lambda data, root: None)
    scale = dataclasses.replace(REHEARSAL, training_engine=None)
    bench = dataclasses.replace(bench, engine="warp", scale=scale, trained={})
    record = Record("learn", "")
    config = learning.gpu_config(name, REHEARSAL, tmp_path, tmp_path)
    assert learning._env(bench, config, record) is env
    assert made == [engine]
    noted = ["Physics is native: warp cannot, or would take minutes here."] if engine == "native" else []
    assert record.notes == noted


def test_a_training_stops_in_time_and_goes_on_later(bench):
    soon = dataclasses.replace(bench, budget=Budget.of(0.01, time.monotonic))
    record = Record("learn", "Until pinch is learned")
    kept = []
    learning.to_success(soon, "pinch", "learn", record, lambda: kept.append(len(record.tables[0].rows)))
    assert [row[0] for row in record.tables[0].rows] == [0]  # the first update takes longer than that
    assert record.left_out == ["what comes after 0 steps"]
    assert kept == [1]
    assert (bench.out / "learn" / "best.npz").is_file()
    assert "curve-learn" in record.figures

    record = Record("long", "On")
    bench = dataclasses.replace(bench, trained=soon.trained)
    learning.to_success(bench, "pinch", "learn", record, lambda: None, further=True)
    assert [row[0] for row in record.tables[0].rows][-1] == REHEARSAL.long_steps
    assert not record.left_out
    seconds, evaluating = zip(*(row[1:3] for row in record.tables[0].rows), strict=True)
    assert all(0 < e < s for s, e in zip(seconds, evaluating, strict=True))
