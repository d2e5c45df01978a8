"""An evaluation: why rollouts failed, which frames count, and means over all of them."""

import dataclasses

import numpy as np
import pytest

from envs.evaluation.evaluate import evaluate
from envs.evaluation.failure import failure_reasons
from envs.evaluation.rollout import Rollouts
from mjx_hand.errors import InputError
from tests.envs.lifts import CUBE, FPS, carried, lift, moved


def path(heights: np.ndarray, reference: np.ndarray) -> Rollouts:
    rollouts = lift(frames=len(heights))
    pose, target = rollouts.object_pose.copy(), rollouts.object_pose.copy()
    pose[0, :, 2], target[0, :, 2] = heights, reference
    return dataclasses.replace(rollouts, object_pose=pose, object_reference=target)


RAMP = np.clip(np.arange(200) / 100, 0, 1) * 0.1
FAST = np.clip(np.arange(200) / 100, 0, 1) * 0.5


@pytest.mark.parametrize(
    ("reason", "rollouts"),
    [
        ("never lifted", path(0.49 * RAMP, RAMP)),
        ("strayed", moved(path(0.51 * RAMP, RAMP), by=0.2)),
        ("dropped", path(np.where(np.arange(200) < 150, RAMP, 0.049), RAMP)),
        ("strayed", moved(path(np.where(np.arange(200) < 150, RAMP, 0.051), RAMP), by=0.2)),
        ("rotated", moved(path(RAMP, RAMP), by=0.0299, angle=1.0)),
        ("strayed", moved(path(RAMP, RAMP), by=0.0301, angle=1.0)),
        ("late", path(np.r_[np.zeros(50), FAST[:-50]], FAST)),
        ("late", path(np.r_[np.zeros(61), FAST[:-61]], FAST)),  # 11 frames past 1 s are 5.5 cm, for half the time
        ("strayed", path(np.r_[np.zeros(75), FAST[:-75]], FAST)),
    ],
)
def test_failure_reasons(reason, rollouts):
    assert failure_reasons(rollouts, np.array([False])) == (reason,)


def test_success_has_no_failure():
    assert failure_reasons(lift(rows=2), np.array([True, True])) == ("", "")


def test_an_object_that_stays_on_the_table_was_not_to_be_lifted():
    flat = path(np.zeros(200), np.zeros(200))
    assert failure_reasons(moved(flat, by=0.2), np.array([False])) == ("strayed",)


def test_frames_that_are_not_counted_never_matter():
    clean = carried(0.01)
    frames = clean.counted.shape[1]
    padding = 30
    padded = {"fps": FPS, "demonstration": clean.demonstration, "least_force": clean.least_force}
    for field in dataclasses.fields(Rollouts):
        values = getattr(clean, field.name)
        if field.name not in padded:
            junk = np.zeros if values.dtype == bool else lambda shape, dtype: np.full(shape, np.nan, dtype)
            extra = junk((1, padding, *values.shape[2:]), values.dtype)
            padded[field.name] = np.concatenate([values, extra], axis=1)
    wild = Rollouts(**padded)
    assert wild.counted.shape[1] == frames + padding
    expected, found = evaluate(clean, [CUBE]), evaluate(wild, [CUBE])
    assert found.rows() == expected.rows()
    assert found.failure == expected.failure


def test_held_frames_count_for_hold_alone():
    rollouts = lift(held=250)
    gone = rollouts.object_pose.copy()
    gone[:, 40:, :3] += 5.0
    found = evaluate(dataclasses.replace(rollouts, object_pose=gone), [CUBE]).rows()
    assert [found.pop(name) for name in ("hold", "kept")] == [0.0, 0.0]
    kept = evaluate(rollouts, [CUBE]).rows()
    assert [kept.pop(name) for name in ("hold", "kept")] == [1.0, 1.0]
    assert found == kept


def test_what_is_lost_on_the_way_is_not_kept():
    rollouts = lift(held=250)
    early = rollouts.object_pose.copy()
    early[:, 17, 0] += 0.11
    found = evaluate(dataclasses.replace(rollouts, object_pose=early), [CUBE]).rows()
    assert [found[name] for name in ("chord", "hold", "kept")] == [0.0, 1.0, 0.0]


def test_what_is_put_down_is_not_to_be_held():
    rollouts = lift(held=250)
    flat = rollouts.object_reference.copy()
    flat[..., 2] = np.where(np.arange(290) < 30, flat[..., 2], 0.0)
    put_down = dataclasses.replace(rollouts, object_pose=flat, object_reference=flat)
    assert "hold" not in evaluate(put_down, [CUBE]).rows()
    assert evaluate(rollouts, [CUBE]).rows()["hold"] == 1.0


def test_rows_are_means_over_all_rollouts():
    rollouts = moved(lift(rows=4), by=np.array([0.0, 0.02, 0.04, 0.2])[:, None])
    found = evaluate(rollouts, [CUBE])
    rows = found.rows()
    assert rows["manip_trans_object"] == 0.5
    assert rows["spider"] == 0.75
    np.testing.assert_allclose(rows["tracking_error_cm"], 6.5)
    assert "hold" not in rows
    assert found.rows(np.array([True, False, False, True]))["spider"] == 0.5
    assert found.failure == ("", "", "strayed", "strayed")
    assert found.failure_shares()["strayed"] == 0.5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"counted": np.zeros((1, 40), bool)}, "rollout 0 has no counted frames"),
        ({"demonstration": np.array([1])}, "1 objects are given"),
        ({"object_pose": np.full((1, 40, 7), np.nan)}, "object_pose of rollout 0 has NaN"),
    ],
)
def test_bad_rollouts_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        evaluate(dataclasses.replace(lift(), **change), [CUBE])


def test_no_rollouts_are_refused():
    with pytest.raises(InputError, match="no rollouts"):
        evaluate(lift(rows=0), [CUBE])
