"""The moved path: by rigid transforms of SciPy's, which know nothing of slides and turns."""

import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from mjx_hand.player.approach import approach_weights, displacement, moved_wrist


def pose(position, rotation: Rotation) -> np.ndarray:
    return np.concatenate([position, rotation.as_quat(scalar_first=True)])


def world_from_hand(wrist: np.ndarray, base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slides along the base's axes, and base Rx Ry Rz."""
    return base @ wrist[:3], base @ Rotation.from_euler("XYZ", wrist[3:]).as_matrix()


@pytest.mark.parametrize("seed", range(20))
def test_the_hand_goes_where_the_object_went(seed):
    random = np.random.default_rng(seed)
    base, centre = Rotation.random(rng=random).as_matrix(), random.normal(size=3)
    wrist = np.concatenate([random.normal(size=3), random.uniform((-3, -1.4, -3), (3, 1.4, 3))])
    if seed % 2:  # the other triple of turns with the same axes
        wrist[4] = np.pi - wrist[4]
    moved = np.array([0.03, -0.02, 0.2])
    place, axes = world_from_hand(wrist + moved_wrist(wrist, base, centre, moved, np), base)
    before, axes_before = world_from_hand(wrist, base)
    turn = Rotation.from_rotvec([0, 0, 0.2])
    assert_allclose(place, centre + np.array([0.03, -0.02, 0]) + turn.apply(before - centre), atol=1e-12)
    assert_allclose(axes, turn.as_matrix() @ axes_before, atol=1e-12)
    change = moved_wrist(wrist, base, centre, moved, np)
    assert np.abs(change[3:]).max() < np.pi  # turns go the short way
    assert_allclose(moved_wrist(jnp.asarray(wrist), base, centre, jnp.asarray(moved), jnp), change, atol=1e-4)


@pytest.mark.parametrize("xp", [np, jnp])
def test_a_displacement_is_what_the_object_was_moved_by(xp):
    random = np.random.default_rng(3)
    for turn in (-3.0, -0.4, 0.0, 0.1, 2.5):
        first = Rotation.random(rng=random)
        seen = pose([0.3, -0.1, 0.4], Rotation.from_rotvec([0, 0, turn]) * first)
        found = displacement(xp.asarray(seen), xp.asarray(pose([0.28, -0.07, 0.1], first)), xp)
        assert_allclose(found, [0.02, -0.03, turn], atol=1e-5)


def test_where_nothing_moved_nothing_is_added():
    first = pose([0.1, 0.2, 0.3], Rotation.random(rng=np.random.default_rng(1))).astype(np.float32)
    still = displacement(first * np.float32(1 + 1e-7), first, np)
    assert_array_equal(still, 0)
    assert_array_equal(moved_wrist(np.full(6, 0.3), np.eye(3), first[:3], still, np), 0)


def test_the_path_leaves_and_comes_back_without_jumps():
    rise = np.clip((np.arange(200) - 100) * 0.002, 0, None)  # at 50 frames a second, held from frame 106 on
    poses = np.tile(pose([0, 0, 0.0], Rotation.identity()), (200, 1))
    poses[:, 2] += rise
    weights = approach_weights(poses, 50.0)
    assert weights[0] == 0
    assert_array_equal(weights[25:107], 1)
    assert_array_equal(weights[147:], 0)
    assert np.abs(np.diff(weights)).max() < 0.07
    assert_array_equal(approach_weights(poses[:100], 50.0)[25:], 1)  # never held: nowhere to go back to
