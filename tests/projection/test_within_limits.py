"""Projection within limits: nothing that a dense grid or SciPy finds inside the box comes nearer."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import least_squares

from mjx_hand.projection import METHODS, project
from mjx_hand.projection.two_dof import nearest_within, project_two_dof_within
from mjx_hand.pytree import replace
from mjx_hand.rigid.rigid_hand import joint_rotations
from tests.projection.samples import about, axis_pairs, hand_with_axes, hinge_axes, random_rotations, residual

COUNT = 60
LOWER, UPPER = np.array([-0.5, -0.3]), np.array([0.4, 1.7])
solve = jax.jit(project_two_dof_within)


def found(rotations, axes):
    lower, upper = (np.tile(limit, (len(rotations), 1)) for limit in (LOWER, UPPER))
    return np.stack(solve(rotations, axes[:, 0], axes[:, 1], lower, upper), axis=-1)


@pytest.mark.parametrize("overlap", [0.0, 0.5, -0.8])
def test_no_pair_of_a_dense_grid_refined_by_scipy_is_better(overlap):
    rotations, axes = random_rotations(COUNT, 1), axis_pairs(COUNT, 2, overlap)
    angles = found(rotations, axes)
    assert np.all(angles >= LOWER - 1e-6)
    assert np.all(angles <= UPPER + 1e-6)
    ticks = [np.linspace(LOWER[k], UPPER[k], 41) for k in range(2)]
    grid = np.stack(np.meshgrid(*ticks), axis=-1).reshape(-1, 2)
    for rotation, pair, angle in zip(rotations, axes, angles, strict=True):
        made = about(pair[0], grid[:, 0]) @ about(pair[1], grid[:, 1])
        start = grid[np.argmin(np.sum((made - rotation) ** 2, axis=(-2, -1)))]

        def error(x, rotation=rotation, pair=pair):
            return (about(pair[0], x[0]) @ about(pair[1], x[1]) - rotation).ravel()

        inner = np.clip(start, LOWER + 1e-9, UPPER - 1e-9)
        best = least_squares(error, inner, bounds=(LOWER, UPPER), xtol=1e-12, ftol=1e-12, gtol=1e-12).x
        assert residual(rotation, pair, angle) <= residual(rotation, pair, best) + 1e-3


def test_inside_the_limits_nothing_changes():
    rng = np.random.default_rng(3)
    axes = axis_pairs(COUNT, 4, 0.3)
    angles = rng.uniform(LOWER, UPPER, (COUNT, 2))
    made = about(axes[:, 0], angles[:, 0]) @ about(axes[:, 1], angles[:, 1])
    np.testing.assert_allclose(found(made, axes), angles, atol=2e-5)


def test_nearest_is_on_the_circle_and_not_on_the_line():
    assert nearest_within(np.array(-3.1), np.array(-0.2), np.array(1.8)) == pytest.approx(1.8)  # 1.4 away, not 2.9
    assert nearest_within(np.array(-3.0), np.array(-0.2), np.array(0.2)) == pytest.approx(-0.2)
    assert nearest_within(np.array(0.1), np.array(-0.2), np.array(1.8)) == pytest.approx(0.1)


@pytest.mark.parametrize("carry", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_every_method_stays_within_the_hands_limits(method, carry):
    rigid = replace(hand_with_axes(hinge_axes(5)), hinge_lower=np.full(20, -0.4), hinge_upper=np.full(20, 1.1))
    angles = np.asarray(project(random_rotations(90, 6).reshape(6, 15, 3, 3), rigid, method, carry=carry, limits=True))
    assert angles.min() >= -0.4 - 1e-6
    assert angles.max() <= 1.1 + 1e-6


def test_gradients_are_finite_within_limits_and_at_them():
    rigid = replace(hand_with_axes(hinge_axes(7)), hinge_lower=np.full(20, -0.4), hinge_upper=np.full(20, 1.1))
    poses = [np.tile(np.eye(3), (15, 1, 1)), random_rotations(15, 8)]
    poses.append(np.asarray(joint_rotations(np.full(20, 1.1), rigid)))
    for pose in poses:
        slope = jax.grad(lambda r: jnp.sum(project(r, rigid, carry=True, limits=True) ** 2))(jnp.asarray(pose))
        assert np.all(np.isfinite(slope))
