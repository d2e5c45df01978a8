"""Keypoints onto the rigid human hand: size, angles and wrist come back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.pytree import replace
from mjx_hand.rigid.bone_lengths import with_link_offsets
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.robots.human_motion import human_motion, sized_hand
from mjx_hand.robots.human_tree import human_tree
from mjx_hand.robots.solver.kinematic_tree import tree_points

FRAMES = 150


@pytest.fixture(scope="module")
def rigid() -> RigidHand:
    return build_rigid_hand(load_hand())


def recorded(rigid: RigidHand) -> tuple[np.ndarray, np.ndarray, Rotation, np.ndarray]:
    """Keypoints, angles, and the wrist's turns and places of a hand that moves and turns freely."""
    rng = np.random.default_rng(0)
    time = np.linspace(0, 2 * np.pi, FRAMES)[:, None]
    swing = 0.5 + 0.45 * np.sin(time * rng.uniform(0.5, 2, 20) + rng.uniform(0, 6, 20))
    angles = np.asarray(rigid.hinge_lower) + swing * (np.asarray(rigid.hinge_upper) - rigid.hinge_lower)
    turns = Rotation.from_rotvec(rng.normal(0, 1, 3) + time * rng.normal(0, 0.5, 3))
    places = rng.normal(0, 0.5, 3) + 0.1 * np.sin(time)
    points = np.asarray(tree_points(angles.astype(np.float32), human_tree(rigid)), float)
    keypoints = np.einsum("tij,tkj->tki", turns.as_matrix(), points) + places[:, None]
    return keypoints, angles, turns, places


def test_angles_wrist_and_gaps(rigid):
    keypoints, angles, turns, places = recorded(rigid)
    keypoints[40:50] = np.nan
    keypoints[80:90, [3, 7]] = np.nan  # one joint of two fingers, whose other points show all angles
    found = human_motion(keypoints, 30.0, rigid)
    seen = found.valid
    np.testing.assert_array_equal(np.flatnonzero(~seen), np.arange(40, 50))
    # A finger bent into its abduction axis hardly shows its abduction, and is held at rest by a little.
    assert np.abs(found.angles - angles)[seen].max() < 0.012
    assert np.percentile(np.abs(found.angles - angles)[seen], 95) < 1e-3
    np.testing.assert_allclose(found.wrist_position[seen], places[seen], atol=1e-4)
    wrist = Rotation.from_quat(found.wrist_quaternion, scalar_first=True)
    assert (wrist.inv() * turns).magnitude()[seen].max() < 1e-3
    assert (found.angles >= rigid.hinge_lower - 1e-6).all()
    assert (found.angles <= np.asarray(rigid.hinge_upper) + 1e-6).all()


def test_the_persons_size_comes_back(rigid):
    lengths = np.random.default_rng(1).uniform(0.85, 1.2, (16, 1))
    own = with_link_offsets(rigid, np.asarray(rigid.link_offset) * lengths)
    own = replace(rigid, link_offset=own.link_offset, tip_offset=own.tip_offset)  # with the model's own axes
    keypoints, *_ = recorded(own)
    keypoints[::7] = np.nan
    keypoints[3, 5] += 0.5  # an outlier
    found = sized_hand(rigid, keypoints)
    np.testing.assert_allclose(found.link_offset, own.link_offset, atol=1e-5)
    np.testing.assert_allclose(found.tip_offset, own.tip_offset, atol=1e-5)
    scaled = sized_hand(rigid, 1.1 * recorded(rigid)[0], "scale")
    np.testing.assert_allclose(scaled.link_offset, 1.1 * np.asarray(rigid.link_offset), atol=1e-5)
    assert sized_hand(rigid, keypoints, "keep") is rigid


def test_bones_that_are_no_hands_are_refused(rigid):
    keypoints, *_ = recorded(rigid)
    for bad, message in (
        (sized_by(keypoints, 20.0), "give metres"),
        (sized_by(keypoints, 0.001), "give metres"),
        (np.where(np.arange(21)[:, None] == 0, keypoints, np.nan), "no bone has both its ends"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            sized_hand(rigid, bad)
        assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="valid: bones, scale, keep"):
        sized_hand(rigid, keypoints, "guess")


def sized_by(keypoints: np.ndarray, factor: float) -> np.ndarray:
    return keypoints * factor


def test_a_real_video_is_followed_to_millimetres(rigid, recordings):
    video = np.load(recordings / "mediapipe_video/joints.npz")["joints"][:150].astype(float)
    own = sized_hand(rigid, video)
    found = human_motion(video, 30.0, own)
    points = np.asarray(tree_points(found.angles.astype(np.float32), human_tree(own)), float)
    turns = Rotation.from_quat(found.wrist_quaternion, scalar_first=True).as_matrix()
    reached = np.einsum("tij,tkj->tki", turns, points) + found.wrist_position[:, None]
    assert 1e3 * np.linalg.norm(reached - video, axis=-1).mean() < 7  # its bones alone vary by 4 to 16 %
    assert np.abs(np.diff(found.angles, axis=0)).max() < 1.5
