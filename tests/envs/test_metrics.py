"""Each metric's definition, by hand-made rollouts just inside and just outside each threshold."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from envs import metrics
from envs.evaluation import evaluate
from envs.failure import failure_reasons
from envs.rollout import Rollouts
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import ObjectDescription

FPS = 50.0
CUBE = ObjectDescription(kind="box", size=np.array([0.02, 0.02, 0.02]), mass=0.1, friction=0.9)


def lift(frames: int = 40, held: int = 0, rows: int = 1) -> Rollouts:
    """Rollouts that follow a 10 cm lift to the letter, and hold on for `held` frames."""
    total = frames + held
    pose = np.zeros((rows, total, 7))
    pose[..., 3] = 1.0
    pose[..., 2] = np.minimum(np.arange(total) / (frames / 2), 1.0) * 0.1
    hand = np.random.default_rng(0).normal(scale=0.05, size=(16, 3)) + pose[:, :, None, :3]
    tips = np.random.default_rng(1).normal(scale=0.05, size=(5, 3)) + pose[:, :, None, :3]
    counted = np.arange(total) < frames
    return Rollouts(
        demonstration=np.zeros(rows, int),
        qpos=np.zeros((rows, total, 33)),
        object_pose=pose,
        object_reference=pose.copy(),
        joints=hand,
        joints_reference=hand.copy(),
        tips=tips,
        tips_reference=tips.copy(),
        counted=np.tile(counted, (rows, 1)),
        held=np.tile(~counted, (rows, 1)),
        reward=np.zeros((rows, total)),
        fps=FPS,
    )


def turned(pose: np.ndarray, angle: float | np.ndarray) -> np.ndarray:
    """Poses turned by an angle (rad) about a slanting axis."""
    axis = np.array([1.0, 2.0, -2.0]) / 3
    turn = Rotation.from_rotvec(np.broadcast_to(angle, pose.shape[:-1])[..., None] * axis)
    quaternion = (turn * Rotation.from_quat(pose[..., 3:], scalar_first=True)).as_quat(scalar_first=True)
    return np.concatenate([pose[..., :3], quaternion], axis=-1)


def moved(rollouts: Rollouts, by: float | np.ndarray = 0.0, angle: float | np.ndarray = 0.0) -> Rollouts:
    """With the object moved sideways by a distance (m) and turned by an angle (rad) in all frames or each."""
    pose = turned(rollouts.object_pose, angle)
    pose[..., 0] += by
    return dataclasses.replace(rollouts, object_pose=pose)


def hand_moved(rollouts: Rollouts, joints: float = 0.0, tips: float = 0.0) -> Rollouts:
    return dataclasses.replace(
        rollouts, joints=rollouts.joints + np.array([0, joints, 0]), tips=rollouts.tips + np.array([0, 0, tips])
    )


def spike(value: float, frames: int = 40) -> np.ndarray:
    """One bad frame among good ones."""
    return np.where(np.arange(frames) == 17, value, 0.0)


SUCCESS = {
    "manip_trans_object": metrics.manip_trans_object,
    "manip_trans_full": metrics.manip_trans_full,
    "spider": metrics.spider,
    "chord": metrics.chord,
}


@pytest.mark.parametrize("metric", SUCCESS)
def test_following_to_the_letter_succeeds(metric):
    assert SUCCESS[metric](lift(rows=3)).tolist() == [True] * 3


@pytest.mark.parametrize(
    ("metric", "inside", "outside"),
    [
        ("manip_trans_object", {"by": 0.0299}, {"by": 0.0301}),
        ("manip_trans_object", {"angle": np.deg2rad(29.9)}, {"angle": np.deg2rad(30.1)}),
        ("manip_trans_full", {"by": 0.0299}, {"by": 0.0301}),
        ("manip_trans_full", {"angle": np.deg2rad(29.9)}, {"angle": np.deg2rad(30.1)}),
        ("spider", {"by": 0.0999}, {"by": 0.1001}),
        ("spider", {"angle": 0.499}, {"angle": 0.501}),
        ("chord", {"by": spike(0.0999)}, {"by": spike(0.1001)}),
        ("chord", {"angle": spike(0.499)}, {"angle": spike(-0.501)}),
    ],
)
def test_object_thresholds(metric, inside, outside):
    assert SUCCESS[metric](moved(lift(), **inside)).all()
    assert not SUCCESS[metric](moved(lift(), **outside)).any()


@pytest.mark.parametrize(
    ("metric", "inside", "outside"),
    [
        ("manip_trans_full", {"joints": 0.0799}, {"joints": 0.0801}),
        ("manip_trans_full", {"tips": 0.0599}, {"tips": 0.0601}),
        ("chord", {"joints": 0.1499}, {"joints": 0.1501}),
    ],
)
def test_hand_thresholds(metric, inside, outside):
    assert SUCCESS[metric](hand_moved(lift(), **inside)).all()
    assert not SUCCESS[metric](hand_moved(lift(), **outside)).any()


def test_the_hand_matters_only_where_the_definition_says_so():
    astray = hand_moved(lift(), joints=0.5, tips=0.5)
    assert metrics.manip_trans_object(astray).all()
    assert metrics.spider(astray).all()
    far_fingers = dataclasses.replace(lift(), joints=lift().joints + np.r_[0.0, np.ones(15)][:, None])
    assert metrics.chord(far_fingers).all()  # its wrist is in place


@pytest.mark.parametrize("metric", ["manip_trans_object", "manip_trans_full", "spider"])
def test_episode_means_forgive_one_bad_frame(metric):
    assert SUCCESS[metric](moved(lift(), by=spike(0.5))).all()


def test_tracking_error_is_the_mean_distance_in_centimetres():
    by = np.linspace(0.0, 0.08, 40)
    np.testing.assert_allclose(metrics.tracking_error(moved(lift(), by=by)), [4.0])


@given(angle=st.floats(-np.pi, np.pi), flip=st.booleans())
@settings(deadline=None, max_examples=40)
def test_rotation_error_is_the_geodesic_angle(angle, flip):
    rollouts = moved(lift(frames=2), angle=angle)
    pose = rollouts.object_pose * np.where(flip, [1, 1, 1, -1, -1, -1, -1], 1)  # q and -q are one rotation
    found = metrics.rotation_error(dataclasses.replace(rollouts, object_pose=pose))
    np.testing.assert_allclose(found, abs(angle), atol=1e-7)


@pytest.mark.parametrize(
    ("by", "area"),
    # The share of frames under thresholds 1 ... 9 cm is a step from 0 to 1; the trapezoid cuts the step's corner.
    [(0.0, 1.0), (0.0101, 7.5 / 8), (0.0299, 6.5 / 8), (0.0301, 5.5 / 8), (0.0899, 0.5 / 8), (0.0901, 0.0)],
)
def test_add_auc_of_a_shift(by, area):
    np.testing.assert_allclose(metrics.add_auc(moved(lift(), by=by), [CUBE]), [area], atol=1e-12)


def test_add_auc_is_a_share_of_frames():
    half = np.where(np.arange(40) < 20, 0.0, 0.5)
    np.testing.assert_allclose(metrics.add_auc(moved(lift(), by=half), [CUBE]), [0.5])


def test_add_auc_feels_a_turn_by_the_distance_of_the_surface():
    """Turning a sphere of radius r by angle a moves its points by 2 r sin(a/2) sin(latitude), pi/4 of it on average."""
    ball = ObjectDescription(kind="sphere", size=np.array([0.05, 0.0, 0.0]), mass=0.1, friction=0.9)
    for aimed, area in ((0.0299, 6.5 / 8), (0.0301, 5.5 / 8)):
        angle = 2 * np.arcsin(aimed / (2 * 0.05 * np.pi / 4))
        np.testing.assert_allclose(metrics.add_auc(moved(lift(), angle=angle), [ball]), [area], atol=1e-12)


def test_each_rollout_has_its_own_demonstrations_object():
    small = dataclasses.replace(CUBE, size=CUBE.size / 10)
    rollouts = dataclasses.replace(moved(lift(rows=2), angle=np.pi), demonstration=np.array([1, 0]))
    first, second = metrics.add_auc(rollouts, [CUBE, small])
    assert first == 1.0
    assert second < 0.9


def carried(slip: float, frames: int = 250) -> Rollouts:
    """A lift, then a hand that wanders and turns with the object, which slips in it by so much over the frames."""
    rollouts = lift(held=frames)
    after = np.clip(np.arange(40 + frames) - 39, 0, None) / frames
    turn = Rotation.from_rotvec(after[:, None] * [0.3, 1.0, -0.4])
    centre = rollouts.object_pose[0, :, :3]
    joints = np.stack([turn.apply(rollouts.joints[0, :, k] - centre) + centre for k in range(16)], axis=1)
    pose = rollouts.object_pose.copy()
    pose[0, :, :3] += turn.apply(slip * after[:, None] * [0.0, 0.0, 1.0])
    pose[0, :, :2] += 0.2 * after[:, None]
    joints[..., :2] += 0.2 * after[:, None, None]
    return dataclasses.replace(rollouts, object_pose=pose, joints=joints[None])


def test_hold_is_slip_in_the_palm():
    assert metrics.hold(carried(0.0)).all()
    assert metrics.hold(carried(0.0199)).all()
    assert not metrics.hold(carried(0.0201)).any()


def test_hold_looks_at_five_seconds_and_no_more():
    assert metrics.hold(carried(0.0398, frames=500)).all()  # 1.99 cm after five of ten seconds
    assert not metrics.hold(carried(0.0402, frames=500)).any()


def test_hold_sees_a_slip_that_comes_back():
    rollouts = carried(0.0)
    pose = rollouts.object_pose.copy()
    pose[0, 100, 1] += 0.03
    assert not metrics.hold(dataclasses.replace(rollouts, object_pose=pose)).any()


def test_an_object_that_was_never_lifted_is_not_held():
    rollouts = lift(held=250)
    low = rollouts.object_pose * [1, 1, 0.49, 1, 1, 1, 1]
    assert not metrics.hold(dataclasses.replace(rollouts, object_pose=low)).any()
    high = rollouts.object_pose * [1, 1, 0.51, 1, 1, 1, 1]
    assert metrics.hold(dataclasses.replace(rollouts, object_pose=high)).all()


def test_hold_needs_five_seconds():
    with pytest.raises(InputError, match=r"4\.98 s.*needs 5 s"):
        metrics.hold(lift(held=249))


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
    padded = {"fps": FPS, "demonstration": clean.demonstration}
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
    assert found.pop("hold") == 0.0
    kept = evaluate(rollouts, [CUBE]).rows()
    assert kept.pop("hold") == 1.0
    assert found == kept


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
