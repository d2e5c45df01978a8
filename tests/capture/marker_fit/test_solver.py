"""The solver's parts against automatic differentiation and dense linear algebra."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mjx_hand.capture.marker_fit.linearise import PoseState, left_jacobian, pose_jacobian, residuals, step_state
from mjx_hand.capture.marker_fit.normal_blocks import NormalBlocks, joint_covariance, normal_blocks, solve_blocks
from mjx_hand.capture.marker_fit.pose_solver import Frames, energy, normal_equations, trust
from mjx_hand.capture.marker_fit.skinned_points import shape_points, skinned_points
from mjx_hand.capture.marker_fit.smoothing import second_difference_bands, smooth_vectors
from mjx_hand.capture.pose.joint_ranges import beyond, joint_ranges
from mjx_hand.capture.pose.pose_prior import habitual_pose, joint_precision, pose_prior
from mjx_hand.capture.pose.wrist import rigid_fit
from mjx_hand.hand.joints import HINGE_LINKS, LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.axes import anatomical_axes
from mjx_hand.rigid.limits import anatomical_limits
from mjx_hand.rotations import exp, hat, log


def test_jacobian_is_the_derivative(hand, marker_set):
    rng = np.random.default_rng(0)
    points = skinned_points(hand, marker_set.vertices, np.zeros((22, 3)), 10)
    # Correctives are left out of the derivative by design, so the comparison is without them.
    points = dataclasses.replace(points, pose_directions=jnp.zeros_like(points.pose_directions))
    rest, centres = shape_points(points, jnp.asarray(rng.normal(size=(2, 10)), jnp.float32))
    state = PoseState(
        vectors=jnp.asarray(rng.normal(size=(2, 15, 3)) * 0.5, jnp.float32).at[0, 4].set(0.0),
        wrist_rotation=exp(jnp.asarray(rng.normal(size=(2, 3)), jnp.float32)),
        wrist_position=jnp.asarray(rng.normal(size=(2, 3)) * 0.1, jnp.float32),
    )
    observed = jnp.asarray(rng.normal(size=(2, 22, 3)) * 0.1, jnp.float32)
    residual, jacobian = jax.jit(pose_jacobian)(points, rest, centres, state, observed)

    def moved(step):
        return residuals(points, rest, centres, step_state(state, step), observed)

    by_step = jax.jit(jax.jacfwd(moved))(jnp.zeros((2, 51)))
    np.testing.assert_allclose(residual, moved(jnp.zeros((2, 51))), atol=1e-6)
    for b in range(2):
        np.testing.assert_allclose(jacobian[b], by_step[b, :, :, b], atol=2e-6)


def test_gradient_is_that_of_the_energy_with_outliers_ranges_and_coupling(hand, marker_set):
    """Against automatic differentiation: poses far outside the ranges, and markers both near the model and far off."""
    rng = np.random.default_rng(5)
    points = skinned_points(hand, marker_set.vertices, np.zeros((22, 3)), 10)
    points = dataclasses.replace(points, pose_directions=jnp.zeros_like(points.pose_directions))
    rest, centres = shape_points(points, jnp.zeros((2, 10)))
    prior = pose_prior(hand)
    state = PoseState(
        vectors=jnp.asarray(rng.normal(size=(2, 15, 3)), jnp.float32),
        wrist_rotation=exp(jnp.asarray(rng.normal(size=(2, 3)), jnp.float32)),
        wrist_position=jnp.zeros((2, 3)),
    )
    assert (jnp.abs(beyond(prior.ranges, state.vectors)) > 0).sum() > 5
    off = jnp.asarray(residuals(points, rest, centres, state, jnp.zeros((2, 22, 3))))
    seen = jnp.einsum("bac,bmc->bma", state.wrist_rotation, off)
    scatter = rng.normal(size=(2, 22, 3)) * np.where(rng.random((2, 22, 1)) < 0.3, 0.05, 0.002)
    frames = Frames(
        observed=seen + jnp.asarray(scatter, jnp.float32),
        weight=jnp.full((2, 22), 1e6),
        rest=rest,
        centres=centres,
        mean=jnp.broadcast_to(prior.mean, (2, 15, 3)),
        precision=prior.precision,
        ranges=prior.ranges,
        outlier=jnp.asarray(0.01),
    )

    def half_energy(step):
        moved = step_state(state, step)
        return energy(frames, residuals(points, rest, centres, moved, frames.observed), moved).sum() / 2

    _, gradient, _, _ = jax.jit(normal_equations)(points, frames, state)
    expected = jax.jit(jax.grad(half_energy))(jnp.zeros((2, 51)))
    np.testing.assert_allclose(gradient, expected, rtol=2e-3, atol=2e-3 * float(jnp.abs(expected).max()))


def test_trust_falls_with_the_distance(hand):
    residual = jnp.asarray([[[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.1, 0.0]]])
    frames = Frames(
        observed=residual,
        weight=jnp.ones((1, 3)),
        rest=residual,
        centres=jnp.zeros((1, 16, 3)),
        mean=jnp.zeros((1, 15, 3)),
        precision=jnp.zeros((5, 9, 9)),
        ranges=joint_ranges(hand),
        outlier=jnp.asarray(0.01),
    )
    np.testing.assert_allclose(trust(frames, residual)[0], [1.0, 0.25, 1 / 101**2], rtol=1e-5)


@pytest.mark.parametrize("side", ["right", "left"])
def test_ranges_are_those_of_the_hinges(side):
    """A joint turned about one hinge by its limit and a little more is beyond by that little."""
    hand = load_hand(side=side)
    ranges = joint_ranges(hand)
    axes = anatomical_axes(np.asarray(hand.joint_regressor, np.float64) @ hand.template, side)
    lower, upper = anatomical_limits()
    for hinge, axis in enumerate(axes):
        joint = HINGE_LINKS[hinge] - 1
        for limit, more in ((upper[hinge], 0.1), (lower[hinge], -0.1), (upper[hinge], -0.05)):
            vectors = np.zeros((1, 15, 3), np.float32)
            vectors[0, joint] = (limit + more) * axis
            over = np.asarray(beyond(ranges, jnp.asarray(vectors)))[0]
            expected = more if abs(more) == 0.1 else 0.0
            assert over[joint].sum() == pytest.approx(expected, abs=1e-5)
            assert not np.delete(over, joint, axis=0).any()


def test_a_distal_joint_is_expected_to_bend_with_its_neighbour(hand):
    """Of a finger whose middle joint is known, the last is expected two thirds as far along."""
    prior = pose_prior(hand)
    flexion = np.asarray(prior.ranges.axes, np.float64)[:, 0]
    for finger in range(4):
        precision = np.asarray(prior.precision[finger], np.float64)
        middle, last = slice(3, 6), slice(6, 9)
        bent = flexion[3 * finger + 1] * np.deg2rad(30)  # 30 degrees more than its mean
        moved = -np.linalg.solve(precision[last, last], precision[last, middle] @ bent)
        expected = np.rad2deg(moved @ flexion[3 * finger + 2])
        # A little less than two thirds: the prior also pulls the joint to its own mean.
        assert 12 < expected < 20


def test_left_jacobian_by_finite_differences():
    for v in ([0.3, -0.8, 0.5], [1e-3, 2e-3, 0.0], [0.0, 0.0, 0.0], [2.0, 1.0, -1.0]):
        v = np.array(v)
        for axis in np.eye(3):
            d = 1e-3
            ahead, behind = (exp(jnp.asarray(v + s * d * axis, jnp.float32)) for s in (1, -1))
            np.testing.assert_allclose(
                log(ahead @ behind.T) / (2 * d), left_jacobian(jnp.asarray(v, jnp.float32)) @ axis, atol=1e-3
            )
    assert hat(jnp.ones(3)).shape == (3, 3)


def test_blocks_solve_like_a_dense_matrix():
    rng = np.random.default_rng(1)
    # Each row speaks of the wrist and of one finger, as a marker does.
    rows = rng.normal(size=(4, 100, 51)).astype(np.float32)
    finger = np.arange(100) % 5
    keep = np.concatenate([np.ones((100, 6)), np.repeat(finger[:, None] == np.arange(5), 9, axis=1)], axis=1)
    rows *= keep
    dense = np.einsum("brp,brq->bpq", rows, rows).astype(np.float64)
    right = rng.normal(size=(4, 51, 3))
    blocks: NormalBlocks = normal_blocks(jnp.asarray(rows))
    np.testing.assert_allclose(
        solve_blocks(blocks, jnp.asarray(right, jnp.float32)), np.linalg.solve(dense, right), atol=2e-4
    )
    inverse = np.linalg.inv(dense)
    expected = np.stack([inverse[:, 6 + 3 * j : 9 + 3 * j, 6 + 3 * j : 9 + 3 * j] for j in range(15)], axis=1)
    np.testing.assert_allclose(joint_covariance(blocks), expected, atol=2e-4)


def test_rigid_fit_finds_the_motion_and_knows_when_it_cannot():
    rng = np.random.default_rng(2)
    model = rng.normal(size=(5, 3)) * 0.05
    turn = np.asarray(exp(jnp.asarray(rng.normal(size=(4, 3)), jnp.float32)), np.float64)
    shift = rng.normal(size=(4, 3))
    observed = np.einsum("tij,mj->tmi", turn, model) + shift[:, None]
    weight = np.ones((4, 5))
    weight[1, 3:] = 0
    observed[1, 3:] = 99  # hidden: must not matter
    weight[2, 2:] = 0  # two markers are on a line
    weight[3] = 0
    rotation, translation, known = rigid_fit(model, observed, weight)
    np.testing.assert_array_equal(known, [True, True, False, False])
    np.testing.assert_allclose(rotation[:2], turn[:2], atol=1e-6)
    np.testing.assert_allclose(translation[:2], shift[:2], atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0)


@pytest.mark.parametrize("link", [name for name in LINKS if name != "wrist"])
def test_prior_is_tightest_off_the_flexion_axis(hand, link):
    prior = pose_prior(hand)
    joint = LINKS.index(link) - 1
    mean = np.asarray(prior.mean[joint], np.float64)
    flexion = mean / np.linalg.norm(mean)
    values, axes = np.linalg.eigh(joint_precision(np.asarray(prior.precision, np.float64))[joint])
    assert abs(axes[:, 0] @ flexion) > 0.99  # the loosest direction
    assert values[1] > 1.4 * values[0]


def test_smoothing_solves_its_least_squares_problem():
    rng = np.random.default_rng(3)
    frames = np.array([0, 1, 2, 5, 6, 7, 8])
    values = rng.normal(size=(7, 15, 3))
    covariance = np.broadcast_to(0.25 * np.eye(3), (7, 15, 3, 3))
    smooth = smooth_vectors(values, covariance, np.zeros((15, 3, 3)), frames, 0.5)
    second = np.diff(np.eye(9), n=2, axis=0)
    np.testing.assert_allclose(
        second_difference_bands(9),
        [np.append(np.diag(second.T @ second, k), np.zeros(k)) for k in range(3)],
    )
    seen = np.eye(9)[frames]
    matrix = 4 * seen.T @ seen + 4 * second.T @ second
    expected = np.linalg.solve(matrix, 4 * seen.T @ values.reshape(7, -1))[frames].reshape(7, 15, 3)
    np.testing.assert_allclose(smooth, expected, atol=1e-10)


def test_habitual_pose_takes_flexion_and_nothing_else(hand):
    prior = pose_prior(hand)
    frames = np.asarray(prior.ranges.axes, np.float64)
    mean = np.asarray(prior.mean, np.float64)
    rng = np.random.default_rng(6)
    turns = rng.normal(size=(4, 15, 3))  # flexion, sideways, about the bone
    habit = habitual_pose(prior, (mean + np.einsum("jka,bjk->bja", frames, turns)).astype(np.float32))
    expected = turns.mean(axis=0) * [1.0, 0.0, 0.0]
    np.testing.assert_allclose(np.einsum("jka,ja->jk", frames, habit - mean), expected, atol=1e-6)
