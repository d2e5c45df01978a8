"""Each metric's definition, by hand-made rollouts just inside and just outside each threshold."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.evaluation import metrics
from envs.evaluation.rollout import Rollouts
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS
from mjx_hand.objects.description import ObjectDescription
from tests.envs.lifts import CUBE, carried, lift, moved, turned


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
    "manip_trans_frames": metrics.manip_trans_frames,
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
        ("manip_trans_frames", {"by": spike(0.0199)}, {"by": spike(0.0201)}),
        ("manip_trans_frames", {"angle": spike(np.deg2rad(29.9))}, {"angle": spike(np.deg2rad(30.1))}),
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
        ("manip_trans_frames", {"joints": 0.0699}, {"joints": 0.0701}),
        ("manip_trans_frames", {"tips": 0.0399}, {"tips": 0.0401}),
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


@pytest.mark.parametrize(("finger", "bound"), list(zip(FINGERS, (0.045, 0.05, 0.06, 0.06, 0.04), strict=True)))
def test_each_finger_has_its_own_bound_in_a_frame(finger, bound):
    for by, good in ((0.999 * bound, True), (1.001 * bound, False)):
        tips = lift().tips.copy()
        tips[0, 17, FINGERS.index(finger), 2] += by
        assert metrics.manip_trans_frames(dataclasses.replace(lift(), tips=tips)).tolist() == [good]


def test_the_first_eight_frames_are_not_judged():
    for frame, good in ((7, True), (8, False)):
        by = np.where(np.arange(40) == frame, 0.5, 0.0)
        assert metrics.manip_trans_frames(moved(lift(), by=by)).tolist() == [good]


def test_the_moving_part_begins_with_the_demonstrated_motion():
    rollouts = lift(held=5)  # 5 mm a frame
    np.testing.assert_array_equal(metrics.moving(rollouts)[0], (np.arange(45) >= 1) & (np.arange(45) < 40))
    still = np.broadcast_to(rollouts.object_reference[:, :1], rollouts.object_reference.shape)
    waiting = dataclasses.replace(rollouts, object_reference=still)
    np.testing.assert_array_equal(metrics.moving(waiting), rollouts.counted)  # never: all of them
    turning = turned(still, np.where(np.arange(45) >= 30, np.deg2rad(5.1), np.deg2rad(4.9)) * (np.arange(45) > 0))
    begun = metrics.moving(dataclasses.replace(rollouts, object_reference=turning))[0]
    np.testing.assert_array_equal(begun, (np.arange(45) >= 30) & (np.arange(45) < 40))
    by = np.where(np.arange(45) < 1, 0.5, 0.01)  # before it is to move nothing matters
    errors = metrics.over(metrics.position_error(moved(rollouts, by=by)), metrics.moving(rollouts))
    np.testing.assert_allclose(errors, [0.01])


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


def test_the_frame_in_which_an_object_is_lost_is_the_first_that_is_off():
    assert metrics.lost(lift()) == (-1,) * len(lift().counted)
    first = int(np.argmax(lift().counted[0]))
    assert metrics.lost(moved(lift(), by=spike(0.0301)))[0] == 17 - first
    assert metrics.lost(moved(lift(), by=spike(0.0299)))[0] == -1
