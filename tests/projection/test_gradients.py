"""Derivatives of the exact projections against finite differences along SO(3)."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mjx_hand import rotations
from mjx_hand.projection import project_one_dof, project_two_dof
from tests.projection.samples import about, axis_pairs, random_rotations


def both(rotation, axes):
    return jnp.stack([*project_two_dof(rotation, axes[0], axes[1]), project_one_dof(rotation, axes[1])])


def turned(step, rotation, axes):
    """The three angles after the rotation has been turned by the rotation vector `step`."""
    return both(rotations.exp(step) @ rotation, axes)


slope = jax.jit(jax.jacrev(turned))
axis_slope = jax.jit(jax.jacrev(both, argnums=1))
AXES = axis_pairs(1, 20, 0.4)[0]
CASES = {
    "rest": np.eye(3),
    "first near +pi": about(AXES[0], np.array(np.pi - 1e-3)),
    "second near -pi": about(AXES[1], np.array(-np.pi + 1e-3)),
    "both": about(AXES[0], np.array(0.3)) @ about(AXES[1], np.array(1.2)),
    **{f"random {i}": r for i, r in enumerate(random_rotations(6, 21))},
}


def differences(rotation, axes, h=1e-5):
    columns = []
    for step in np.eye(3) * h:
        ahead = np.asarray(both(about(step / h, np.array(h)) @ rotation, axes))
        behind = np.asarray(both(about(step / h, np.array(-h)) @ rotation, axes))
        columns.append((np.mod(ahead - behind + np.pi, 2 * np.pi) - np.pi) / (2 * h))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("case", CASES)
def test_slope_is_that_of_finite_differences(case):
    with jax.enable_x64(True):
        expected = differences(CASES[case], AXES)
        precise = slope(jnp.zeros(3), CASES[case], AXES)
    np.testing.assert_allclose(precise, expected, atol=1e-6, rtol=1e-6)
    single = slope(jnp.zeros(3, jnp.float32), CASES[case].astype(np.float32), AXES.astype(np.float32))
    assert single.dtype == jnp.float32
    np.testing.assert_allclose(single, expected, atol=1e-3, rtol=1e-3)


def test_slope_in_the_axes_is_that_of_finite_differences():
    with jax.enable_x64(True):
        rotation, h = CASES["both"] @ about(AXES[0], np.array(0.2)), 1e-6
        expected = np.zeros((3, 2, 3))
        for i, j in np.ndindex(2, 3):
            step = np.zeros((2, 3))
            step[i, j] = h
            expected[:, i, j] = (both(rotation, AXES + step) - both(rotation, AXES - step)) / (2 * h)
        np.testing.assert_allclose(axis_slope(rotation, jnp.asarray(AXES)), expected, atol=1e-7)


@pytest.mark.parametrize("tied", [np.array([[0, -1.0, 0], [1, 0, 0], [0, 0, 1]]), np.diag([1.0, -1, -1])])
def test_slope_is_finite_where_the_best_angles_are_not_unique(tied):
    axes = np.eye(3, dtype=np.float32)[:2]
    for pair in (axes, np.stack([axes[0], axes[0]]), np.stack([axes[1], -axes[1]])):
        assert np.all(np.isfinite(slope(jnp.zeros(3, jnp.float32), tied.astype(np.float32), pair)))
