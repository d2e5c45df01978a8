"""Rotations from bone directions: directions exactly, and the roll as far as it can be seen."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mjx_hand.capture.keypoint_fit.rotations import joint_rotations_along, universal_joint
from mjx_hand.capture.keypoints.skeleton import bone_directions, posed_keypoints, skeleton
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Motion
from mjx_hand.pytree import replace
from tests.capture.keypoints.grips import grip, keypoints_of

FINGER_JOINTS = slice(0, 12)


def wrists(motion: Motion) -> np.ndarray:
    return Rotation.from_quat(motion.wrist_quaternion, scalar_first=True).as_matrix()


def found_rotations(motion: Motion) -> np.ndarray:
    rest = skeleton(load_hand(side=motion.side), motion.shape)
    return joint_rotations_along(bone_directions(keypoints_of(motion)), wrists(motion), rest)


def angles_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    turn = Rotation.from_matrix(np.swapaxes(a, -1, -2).reshape(-1, 3, 3) @ b.reshape(-1, 3, 3))
    return np.rad2deg(turn.magnitude()).reshape(a.shape[:-2])


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_hand_that_only_bends_is_recovered_exactly(side):
    motion = grip(side, spread=0.0)
    error = angles_between(motion.rotations, found_rotations(motion))
    assert error[:, FINGER_JOINTS].max() < 0.01


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_hand_that_also_spreads_is_recovered_but_for_a_little_roll(side):
    # The hinges abduct before they bend: at a bent knuckle that is partly roll, which only bent outer joints show.
    error = angles_between(grip(side).rotations, found_rotations(grip(side)))
    assert error.mean() < 2.0
    assert error.max() < 12.0


@pytest.mark.parametrize("side", ["right", "left"])
def test_every_bone_points_as_observed(side):
    motion = grip(side)
    rest = skeleton(load_hand(side=side), motion.shape)
    again = posed_keypoints(rest, found_rotations(motion), wrists(motion), motion.wrist_position)
    np.testing.assert_allclose(again, keypoints_of(motion), atol=1e-6)


def test_roll_is_seen_where_outer_joints_bend_and_not_where_they_are_straight():
    motion = grip(spread=0.0)
    rolled = 15.0  # degrees about the index finger's first bone
    rest = skeleton(load_hand(), motion.shape)
    turn = Rotation.from_rotvec(np.deg2rad(rolled) * rest.directions[0, 0]).as_matrix()
    bent = motion.rotations.copy()
    bend = Rotation.from_rotvec(np.deg2rad(70.0) * rest.flexion[0, 1]).as_matrix()
    bent[:, 0], bent[:, 1] = turn, bend
    straight = bent.copy()
    straight[:, 1:3] = np.eye(3)

    def roll_found(rotations: np.ndarray) -> float:
        found = found_rotations(replace(motion, rotations=rotations))[:, 0]
        return float(np.rad2deg(Rotation.from_matrix(found).as_rotvec() @ rest.directions[0, 0]).mean())

    assert roll_found(bent) > 0.75 * rolled
    assert abs(roll_found(straight)) < 0.1


@settings(deadline=None, max_examples=50)
@given(st.floats(-1.5, 2.0), st.floats(-0.8, 0.8), st.integers(0, 100))
def test_a_universal_joint_gives_back_its_two_angles(flexion, sideways, seed):
    rng = np.random.default_rng(seed)
    axis, bone = np.linalg.qr(rng.normal(size=(3, 3)))[0].T[:2]
    beside = np.cross(axis, bone)
    made = Rotation.from_rotvec(flexion * axis) * Rotation.from_rotvec(sideways * beside)
    found = universal_joint(bone[None], axis[None], made.apply(bone)[None, None])[0, 0]
    np.testing.assert_allclose(found, made.as_matrix(), atol=1e-7)


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 10_000))
def test_any_directions_give_rotations_that_point_there(seed):
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(1, 5, 3, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    rest = skeleton(load_hand(), np.zeros(10))
    found = joint_rotations_along(directions, np.eye(3)[None], rest)
    np.testing.assert_allclose(found @ np.swapaxes(found, -1, -2), np.broadcast_to(np.eye(3), found.shape), atol=1e-9)
    points = posed_keypoints(rest, found, np.eye(3)[None], np.zeros((1, 3)))
    np.testing.assert_allclose(bone_directions(points), directions, atol=1e-6)
