"""Each frame's answer comes of that frame: not of its number, of missing neighbours, nor of the rate.

The right values are the little hand's own, from the test's own kinematics.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.pytree import replace
from mjx_hand.robots.palm_frame import in_palm
from mjx_hand.robots.robot_hand import load_robot, robot_objective
from mjx_hand.robots.solver.keypoint_stream import KeypointStream
from mjx_hand.robots.solver.kinematic_tree import HELD, joint_values, tree_points
from mjx_hand.robots.solver.retarget_keypoints import Followed, retarget_keypoints
from tests.robots import little_hand
from tests.robots.little_hand import keypoints_of, motion, postures, values_of


@pytest.fixture(scope="module")
def hand(tmp_path_factory):
    urdf, description = little_hand.write(tmp_path_factory.mktemp("robot"))
    return robot_objective(load_robot(description), urdf)


def degrees_off(found: Followed, true: np.ndarray, hand) -> np.ndarray:
    """(t,): of the hinge that is farthest from its true value."""
    return np.degrees(np.abs(values_of(hand[0].dof_names, found.dofs) - true).max(axis=(1, 2)))


@pytest.mark.parametrize(
    "missing", [[0], [8], [24], [63], [23, 24, 25], [7, 9], list(range(0, 64, 8)), list(range(40))]
)
def test_missing_frames_change_no_other(hand, missing):
    true = motion(64, 30.0)
    keypoints = keypoints_of(true)
    whole = retarget_keypoints(keypoints, *hand)
    keypoints[missing] = np.nan
    found = retarget_keypoints(keypoints, *hand)
    there = np.setdiff1d(np.arange(64), missing)
    np.testing.assert_array_equal(np.flatnonzero(found.valid), there)
    beside = np.isin(there - 1, missing) | np.isin(there + 1, missing)  # whose smoothing has one neighbour fewer
    change = np.degrees(np.abs(found.dofs - whole.dofs).max(axis=1))[there]
    assert change[~beside].max() < 0.2
    assert change.max() < 1.0
    assert degrees_off(found, true, hand)[there].max() < 1.0


def test_the_same_postures_at_any_rate_and_held_agree(hand):
    true = postures(40)
    keypoints = keypoints_of(true)
    found = {fps: retarget_keypoints(keypoints, *hand, fps=fps) for fps in (1.0, 5.0, 30.0, 120.0)}
    for fps, followed in found.items():
        assert degrees_off(followed, true, hand).max() < 1.0, fps
    held = retarget_keypoints(np.repeat(keypoints, 16, axis=0), *hand, fps=30.0)
    assert degrees_off(held, np.repeat(true, 16, axis=0), hand).max() < 1.0


def test_a_motion_is_followed_as_well_at_every_rate(hand):
    for fps in (3.0, 5.0, 10.0, 30.0, 60.0):
        true = motion(int(4 * fps), fps)
        assert degrees_off(retarget_keypoints(keypoints_of(true), *hand, fps=fps), true, hand).max() < 1.0, fps


def test_smoothing_is_per_second(hand):
    """Jitter of the same size and the same times, seen at two rates, is damped more where frames are closer."""
    true = postures(1).repeat(240, axis=0)
    noisy = keypoints_of(true) + np.random.default_rng(1).normal(0, 0.0007, (240, 21, 3))
    rough, slow, quick = (
        np.diff(retarget_keypoints(noisy, hand[0], objective, fps=fps).dofs, axis=0).std()
        for objective, fps in ((replace(hand[1], smoothness=0.0), 30.0), (hand[1], 30.0), (hand[1], 60.0))
    )
    assert quick < 0.9 * slow < 0.8 * rough


def test_a_finger_without_its_tip_goes_on_between_its_neighbours(hand):
    true = motion(48, 30.0)
    keypoints = keypoints_of(true)
    lost = [8, 9, 10, 47]
    keypoints[lost, 8] = np.nan  # the index tip, all that shows the index finger's hinges
    found = retarget_keypoints(keypoints, *hand)
    assert found.valid.all()
    off = np.degrees(np.abs(values_of(hand[0].dof_names, found.dofs) - true))
    assert off[:, [0, 2, 3]].max() < 1.0
    assert np.delete(off[:, 1], lost, axis=0).max() < 1.0
    assert off[8:11, 1].max() < 5.0  # on a line between frames 7 and 11
    np.testing.assert_allclose(found.dofs[47], found.dofs[46], atol=0.1)


@pytest.mark.parametrize("lost", [["index_mcp"], ["middle_mcp"], ["ring_mcp"], ["wrist"], ["wrist", "ring_mcp"]])
def test_a_missing_knuckle_is_no_gap(hand, lost):
    names = little_hand.KEYPOINTS
    true = motion(20, 30.0)
    keypoints = keypoints_of(true) + np.array([0.3, 0.1, 0.5])
    keypoints[[4, 5, 16], [[names.index(name)] for name in lost]] = np.nan
    found = retarget_keypoints(in_palm(keypoints, "right", np.array([0, 0, 1.0]), np.array([1.0, 0, 0])), *hand)
    assert found.valid.all()
    assert degrees_off(found, true, hand).max() < 1.0


def test_a_stream_begins_anew_after_a_gap(hand):
    true = postures(12, seed=3)
    stream = KeypointStream(*hand)
    keypoints = keypoints_of(true)
    for k in range(0, 12, 2):
        pose = stream.step(keypoints[k])
        assert (
            np.degrees(np.abs(values_of(hand[0].dof_names, np.asarray(pose.dofs)[None]) - true[k : k + 1]).max()) < 1.0
        )
        stream.step(np.full((21, 3), np.nan))
    slow = KeypointStream(*hand, low_pass=0.1)
    slow.step(keypoints[0])
    slow.step(np.full((21, 3), np.nan))
    pose = slow.step(keypoints[1])
    assert np.degrees(np.abs(values_of(hand[0].dof_names, np.asarray(pose.dofs)[None]) - true[1:2]).max()) < 1.0


def test_a_streams_filter_is_per_second(hand):
    keypoints = keypoints_of(np.linspace(postures(1)[0], postures(1)[0] + 0.1, 2))
    shares = []
    for fps in (30.0, 60.0):
        stream = KeypointStream(hand[0], replace(hand[1], smoothness=0.0), low_pass=0.75, fps=fps)
        first = stream.step(keypoints[0]).dofs
        last = [stream.step(keypoints[1]).dofs for _ in range(int(fps / 30))][-1]
        shares.append(np.mean((last - first) / 0.1))
    np.testing.assert_allclose(shares, 0.75, atol=0.02)


def test_joints_above_the_palm_stand_still(tmp_path):
    urdf, description = little_hand.write(tmp_path, arm=True)
    true = motion(24, 30.0)
    tree, objective = robot_objective(load_robot(description), urdf)
    found = retarget_keypoints(keypoints_of(true), tree, objective)
    values = joint_values(found.dofs, tree)
    arm = [tree.joint_names.index(name) for name in ("shoulder", "wrist")]
    np.testing.assert_array_equal(values[:, arm], 0.0)
    assert np.degrees(np.abs(values_of(tree.joint_names, values) - true).max()) < 1.0
    free, _ = robot_objective(load_robot(description), urdf, "position")
    assert [free.dofs[free.joint_names.index(name)] for name in ("shoulder", "wrist")] == [HELD, HELD]


@pytest.mark.slow
def test_positions_are_reached_from_any_posture(tmp_path):
    urdf, description = little_hand.write(tmp_path)
    tree, objective = robot_objective(load_robot(description), urdf, "position")
    true = postures(40, seed=5)
    found = retarget_keypoints(keypoints_of(true), tree, objective, fps=5.0)
    places = tree_points(found.dofs.astype(np.float32), tree)
    turns = Rotation.from_quat(found.base_quaternion, scalar_first=True).as_matrix()
    world = np.einsum("tij,tkj->tki", turns, places) + found.base_position[:, None]
    assert 1e3 * np.linalg.norm(world - keypoints_of(true)[:, little_hand.TIPS], axis=-1).max() < 1.0  # mm
