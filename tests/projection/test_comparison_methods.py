"""The paper's two-axis iteration does nothing; one order further it does something."""

import jax
import jax.numpy as jnp
import numpy as np

from mjx_hand.projection.paper import bch2_two_dof, naive_two_dof, paper_two_dof
from tests.projection.samples import about, anatomical_poses, axis_pairs, random_rotations, residual


def reachable(axes, angles):
    return about(axes[:, 0], angles[:, 0]) @ about(axes[:, 1], angles[:, 1])


def solve(method, rotations, axes):
    return np.stack(method(rotations, axes[:, 0], axes[:, 1]), axis=-1)


def test_papers_iteration_is_the_naive_answer_for_orthogonal_axes():
    rotations, axes = random_rotations(200, 30), axis_pairs(200, 31, 0.0)
    np.testing.assert_allclose(solve(paper_two_dof, rotations, axes), solve(naive_two_dof, rotations, axes), atol=2e-6)


def test_papers_iteration_moves_for_oblique_axes():
    """There the naive components double-count the axes' overlap, and the relaxed steps undo part of it."""
    axes = axis_pairs(40, 32, 0.5)
    made = reachable(axes, anatomical_poses(8, 33)[0].reshape(40, 2))
    naive, paper = (residual(made, axes, solve(m, made, axes)).mean() for m in (naive_two_dof, paper_two_dof))
    assert paper < 0.5 * naive


def test_next_order_corrects():
    axes = axis_pairs(40, 34, 0.0)
    made = reachable(axes, anatomical_poses(8, 35)[0].reshape(40, 2))
    naive, corrected = (residual(made, axes, solve(m, made, axes)).mean() for m in (naive_two_dof, bch2_two_dof))
    assert corrected < 0.1 * naive


def test_order_of_the_errors():
    """Halving the angles divides the error by 2³ for the naive answer, by 2⁵ with the next order, oblique axes too."""
    with jax.enable_x64(True):
        axes = axis_pairs(20, 36, 0.0)
        angles = np.random.default_rng(37).uniform(0.1, 0.3, (20, 2))
        for method, order in ((naive_two_dof, 3), (bch2_two_dof, 5)):
            whole, half = (np.abs(solve(method, reachable(axes, t), axes) - t).mean() for t in (angles, angles / 2))
            assert abs(np.log2(whole / half) - order) < 0.3
        oblique = axis_pairs(20, 36, 0.5)
        assert np.abs(solve(bch2_two_dof, reachable(oblique, angles), oblique) - angles).max() < 2e-3


def test_every_answer_is_finite():
    rotations, axes = random_rotations(500, 38), axis_pairs(500, 39, 0.99)
    for method in (naive_two_dof, paper_two_dof, bch2_two_dof):
        assert np.all(np.isfinite(solve(method, rotations, axes)))
        assert np.all(np.isfinite(solve(method, rotations, np.stack([axes[:, 0], axes[:, 0]], axis=1))))
    assert np.all(np.isfinite(jnp.stack(jax.jit(bch2_two_dof)(jnp.eye(3), jnp.eye(3)[0], jnp.eye(3)[1]))))
