"""Keypoints become the hinges that made them, whatever is missing, whichever way the hand is turned."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.live.twin.hand_solver import HandSolver
from envs.live.twin.hinge_keypoints import hinge_keypoints
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand


@pytest.fixture(scope="module", params=["right", "left"])
def hand(request) -> RigidHand:
    return build_rigid_hand(load_hand(side=request.param), [1.0, -0.5])


def postures(rigid: RigidHand, count: int, seed: int) -> np.ndarray:
    """Hinge angles well within their limits."""
    low, high = np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper)
    share = np.random.default_rng(seed).uniform(0.25, 0.75, (count, 20))
    return low + share * (high - low)


def test_a_frame_alone_is_found_at_any_posture_and_turn(hand):
    rng = np.random.default_rng(0)
    angles, turns = postures(hand, 20, 1), Rotation.from_quat(rng.normal(size=(20, 4)))
    places = rng.normal(size=(20, 3))
    keypoints = hinge_keypoints(angles, places, turns.as_quat(scalar_first=True), hand)
    off, solver = [], HandSolver(hand)
    for k, frame in enumerate(keypoints):
        assert solver.solve(np.full((21, 3), np.nan)) is None  # so that the next follows none
        found = solver.solve(frame)
        assert found is not None
        position, quaternion, bent = found
        off.append(np.abs(bent - angles[k]).max())
        np.testing.assert_allclose(position, places[k], atol=2e-3)
        assert (Rotation.from_quat(quaternion, scalar_first=True).inv() * turns[k]).magnitude() < 0.05
    assert np.max(off) < 0.05


def test_a_motion_is_followed_and_missing_keypoints_are_bridged(hand):
    start, end = postures(hand, 2, 3)
    share = np.linspace(0, 1, 60)[:, None]
    angles = (1 - share) * start + share * end
    turns = Rotation.from_rotvec(np.linspace(0, 2.5, 60)[:, None] * [0.3, -0.5, 0.8])
    places = np.linspace([0, 0, 0], [0.3, 0.2, -0.1], 60)
    keypoints = hinge_keypoints(angles, places, turns.as_quat(scalar_first=True), hand)
    rng, solver = np.random.default_rng(4), HandSolver(hand)
    for k, frame in enumerate(keypoints):
        frame = frame.copy()
        frame[rng.choice(21, 4, replace=False)] = np.nan
        found = solver.solve(frame)
        assert found is not None
        assert np.abs(found[2] - angles[k]).max() < 0.2
        np.testing.assert_allclose(found[0], places[k], atol=5e-3)


def test_angles_stay_within_the_hinges_limits(hand):
    beyond = np.asarray(hand.hinge_upper) + 0.5
    keypoints = hinge_keypoints(beyond[None], np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]), hand)[0]
    found = HandSolver(hand).solve(keypoints)
    assert found is not None
    assert (found[2] <= np.asarray(hand.hinge_upper) + 1e-9).all()
    assert (found[2] >= np.asarray(hand.hinge_lower) - 1e-9).all()


def test_too_few_keypoints_and_no_hand_are_not_followed(hand):
    solver, rng = HandSolver(hand), np.random.default_rng(5)
    good = hinge_keypoints(postures(hand, 1, 6), np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]), hand)[0]
    few = np.full((21, 3), np.nan)
    few[:7] = good[:7]
    fingers = good.copy()
    fingers[[0, 1, 5, 9]] = np.nan
    for nothing in (np.full((21, 3), np.nan), few, fingers, rng.normal(size=(21, 3)), np.zeros((21, 3))):
        assert solver.solve(nothing) is None
        found = solver.solve(good)
        assert found is not None
        assert np.isfinite(np.concatenate(found)).all()
