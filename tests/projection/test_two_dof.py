import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjx_hand.projection import project_two_dof
from tests.projection.samples import about, anatomical_poses, axis_pairs, best_residual, random_rotations, residual

solve = jax.jit(lambda rotation, axes: jnp.stack(project_two_dof(rotation, axes[..., 0, :], axes[..., 1, :]), axis=-1))
OVERLAPS = (0.0, 0.5, -0.8)


def worst_excess(rotations, axes):
    """How much worse (degrees) than SciPy's best the exact solution is, at most."""
    found = residual(rotations, axes, np.asarray(solve(rotations, axes)))
    best = [best_residual(r, a) for r, a in zip(rotations, axes, strict=True)]
    return np.max(found - best)


@pytest.mark.parametrize("overlap", OVERLAPS)
def test_no_angles_that_scipy_finds_are_better_on_random_rotations(overlap):
    assert worst_excess(random_rotations(40, 3), axis_pairs(40, 4, overlap)) < 1e-3


@pytest.mark.parametrize("overlap", OVERLAPS)
def test_no_angles_that_scipy_finds_are_better_on_anatomical_poses(overlap):
    angles, off_axis = anatomical_poses(8, 5)
    axes = axis_pairs(40, 6, overlap)
    angles, off_axis = angles.reshape(40, 2), off_axis.reshape(40, 3, 3)
    reached = about(axes[:, 0], angles[:, 0]) @ about(axes[:, 1], angles[:, 1])
    assert worst_excess(reached @ off_axis, axes) < 1e-3


@pytest.mark.slow
def test_no_angles_that_scipy_finds_are_better_on_ten_thousand_random_rotations():
    overlaps = np.random.default_rng(7).uniform(-0.95, 0.95, 10_000)
    overlaps[:5000] = 0.0
    axes = axis_pairs(10_000, 8, overlaps[:, None])
    assert worst_excess(random_rotations(10_000, 9), axes) < 1e-3


angle = st.floats(-3.1, 3.1)


@settings(deadline=None, max_examples=60)
@given(first=angle, second=angle, overlap=st.floats(-0.9, 0.9), seed=st.integers(0, 2**20))
def test_recovers_every_pair_of_angles(first, second, overlap, seed):
    axes = axis_pairs(1, seed, overlap)[0]
    made = about(axes[0], np.array(first)) @ about(axes[1], np.array(second))
    np.testing.assert_allclose(solve(made, axes), [first, second], atol=2e-5)


def test_float64_keeps_its_digits():
    angles = np.random.default_rng(10).uniform(-3.1, 3.1, (40, 2))
    axes = axis_pairs(40, 11, 0.6)
    made = about(axes[:, 0], angles[:, 0]) @ about(axes[:, 1], angles[:, 1])
    with jax.enable_x64(True):
        found = jnp.stack(project_two_dof(made, axes[:, 0], axes[:, 1]), axis=-1)
        assert found.dtype == jnp.float64
        np.testing.assert_allclose(found, angles, atol=1e-12)


def test_axes_broadcast_against_rotations():
    rotations, axes = random_rotations(40, 12), axis_pairs(5, 13, 0.3)
    both = solve(rotations.reshape(8, 5, 3, 3), axes)
    assert both.shape == (8, 5, 2)
    np.testing.assert_allclose(both[3, 2], solve(rotations[17], axes[2]), atol=1e-5)


@pytest.mark.parametrize("overlap", OVERLAPS)
def test_rest_is_zero(overlap):
    np.testing.assert_allclose(solve(np.eye(3), axis_pairs(1, 14, overlap)[0]), [0, 0], atol=1e-7)


@pytest.mark.parametrize("overlap", OVERLAPS)
@pytest.mark.parametrize("which", [0, 1])
def test_half_turn_about_an_axis(overlap, which):
    axes = axis_pairs(1, 15, overlap)[0]
    found = np.asarray(solve(about(axes[which], np.array(np.pi)), axes))
    assert abs(found[which]) == pytest.approx(np.pi, abs=1e-5)
    assert found[1 - which] == pytest.approx(0, abs=1e-5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_parallel_axes_use_the_second_alone(sign):
    axes = np.stack([[0, 0, 1.0], [0, 0, sign]])
    np.testing.assert_allclose(solve(about(axes[0], np.array(0.7)), axes), [0, sign * 0.7], atol=1e-6)


@pytest.mark.parametrize("turn", [np.pi / 2, -np.pi / 2])
def test_tie_gives_the_member_with_no_first_angle(turn):
    axes = np.eye(3)[:2]
    tied = np.round(about(np.eye(3)[2], np.array(turn)))
    found = np.asarray(solve(tied, axes))
    assert found[0] == 0
    assert residual(tied, axes, found) <= best_residual(tied, axes) + 1e-3


@pytest.mark.parametrize("distance", [1e-7, 1e-6, 1e-5, 1e-4, 1e-3])
def test_near_a_tie_rounding_costs_nothing(distance):
    """φ itself is then at the mercy of rounding; what is found must still be as good as the best."""
    axes = np.tile(np.eye(3)[:2], (40, 1, 1))
    near = about(np.eye(3)[2], np.array(np.pi / 2)) @ about(random_rotations(40, 16)[:, :, 0], np.full(40, distance))
    with jax.enable_x64(True):
        best = residual(near, axes, np.stack(project_two_dof(near, axes[:, 0], axes[:, 1]), axis=-1))
    assert np.max(residual(near, axes, np.asarray(solve(near, axes))) - best) < 1e-3


def test_length_of_the_arguments_is_the_cosine_of_what_remains():
    """For orthogonal axes; so the angles are well determined wherever the hinges come within 90 degrees."""
    rotations, axes = random_rotations(40, 17), axis_pairs(40, 18, 0.0)
    moved = np.einsum("nij,nj->ni", rotations, axes[:, 1])
    length = np.hypot(np.sum(np.cross(axes[:, 0], axes[:, 1]) * moved, axis=1), np.sum(axes[:, 1] * moved, axis=1))
    remains = residual(rotations, axes, np.asarray(solve(rotations, axes)))
    np.testing.assert_allclose(length, np.cos(np.radians(remains)), atol=1e-5)
