import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mjx_hand.projection import project_one_dof
from mjx_hand.projection.paper import paper_one_dof
from tests.projection.samples import about, best_residual, random_rotations, residual

solve = jax.jit(project_one_dof)
AXES = random_rotations(40, 1)[:, :, 0]
ROTATIONS = random_rotations(40, 2)


def test_no_angle_that_scipy_finds_is_better():
    found = residual(ROTATIONS, AXES[:, None], np.asarray(solve(ROTATIONS, AXES))[:, None])
    best = [best_residual(r, a[None], grid=90) for r, a in zip(ROTATIONS, AXES, strict=True)]
    assert np.max(found - best) < 1e-3


def test_recovers_any_angle_about_the_axis():
    angles = np.linspace(-3.1, 3.1, 40)
    np.testing.assert_allclose(solve(about(AXES, angles), AXES), angles, atol=2e-6)


def test_float64_keeps_its_digits():
    angles = np.linspace(-3.1, 3.1, 40)
    with jax.enable_x64(True):
        found = project_one_dof(jnp.asarray(about(AXES, angles)), jnp.asarray(AXES))
        assert found.dtype == jnp.float64
        np.testing.assert_allclose(found, angles, atol=1e-13)


def test_papers_formula_agrees_only_where_the_axis_is_the_rotations_own():
    angles = np.linspace(-3.0, 3.0, 40)
    np.testing.assert_allclose(paper_one_dof(about(AXES, angles), AXES), angles, atol=2e-6)
    off = about(AXES, angles) @ about(random_rotations(40, 3)[:, :, 0], np.full(40, np.radians(60)))
    paper = residual(off, AXES[:, None], np.asarray(paper_one_dof(off, AXES))[:, None])
    exact = residual(off, AXES[:, None], np.asarray(solve(off, AXES))[:, None])
    assert np.all(exact <= paper + 1e-4)
    assert np.mean(paper - exact) > 0.5


def test_papers_formula_is_the_printed_one():
    skew = (ROTATIONS - np.swapaxes(ROTATIONS, 1, 2)) / 2
    vector = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=-1)
    printed = np.arctan2(np.sum(vector * AXES, axis=1), (np.trace(ROTATIONS, axis1=1, axis2=2) - 1) / 2)
    np.testing.assert_allclose(paper_one_dof(ROTATIONS, AXES), printed, atol=1e-5)


@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_half_turn_is_plus_pi(zero):
    half_turn = np.array([[-1.0, -zero, 0], [zero, -1.0, 0], [0, 0, 1.0]])
    assert solve(half_turn, np.array([0.0, 0.0, 1.0])) == pytest.approx(np.pi)


def test_rotation_that_says_nothing_of_the_angle_gives_zero_and_a_finite_gradient():
    half_turn = np.diag([1.0, -1.0, -1.0])
    z = jnp.array([0.0, 0.0, 1.0])
    assert solve(half_turn, z) == 0
    assert np.all(np.isfinite(jax.grad(project_one_dof)(jnp.asarray(half_turn), z)))


def test_axes_broadcast_against_rotations():
    both = solve(ROTATIONS.reshape(8, 5, 3, 3), AXES[:5])
    assert both.shape == (8, 5)
    np.testing.assert_allclose(both[3, 2], solve(ROTATIONS[17], AXES[2]), atol=1e-6)
