"""Poses of many frames at once: Levenberg-Marquardt on markers and prior, each frame with its own damping."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from mjx_hand.capture.marker_fit.linearise import NUM_POSE, PoseState, pose_jacobian, residuals, step_state
from mjx_hand.capture.marker_fit.normal_blocks import (
    NormalBlocks,
    damped,
    joint_covariance,
    normal_blocks,
    solve_blocks,
)
from mjx_hand.capture.marker_fit.skinned_points import SkinnedPoints
from mjx_hand.capture.pose.joint_ranges import GIVE, JointRanges, beyond
from mjx_hand.pytree import pytree, replace

INITIAL_DAMPING = 1e-3  # relative to the diagonal of the normal matrix
ACCEPTED, REJECTED = 0.2, 8.0  # how the damping changes after a step
# Keeps a frame without markers solvable: far below what one marker (1e6) or the prior (at least 2) says.
FLOOR = 1e-2


@pytree
class Frames:
    """A batch of frames to fit, in JAX or NumPy arrays; metres, the world shifted near each frame's markers.

    Attributes:
        observed: marker positions, zero where there is none.
        weight: inverse variance of each marker (1/m^2), zero where it is not visible.
        rest: each frame's own rest markers (its subject's shape and skin offsets).
        centres: its subject's joint centres.
        mean, precision: normal prior of the rotation vectors.
        ranges: ranges of the joints' motion.
        outlier: how far (m) from the model a marker loses most of its say: a wrong one then cannot drag the hand.
    """

    observed: Float[Any, "b m 3"]
    weight: Float[Any, "b m"]
    rest: Float[Any, "b m 3"]
    centres: Float[Any, "b 16 3"]
    mean: Float[Any, "b 15 3"]
    precision: Float[Any, "5 9 9"]
    ranges: JointRanges
    outlier: Float[Any, ""]


def trust(frames: Frames, residual: Float[Array, "b m 3"]) -> Float[Array, "b m"]:
    """The share of its say that each marker keeps: 1 at the model, a quarter at `outlier`, falling to nothing.

    The weights of Geman and McClure's estimator (1987), whose loss is the squared distance times this one's root.
    """
    return jnp.square(frames.outlier**2 / (frames.outlier**2 + jnp.sum(residual**2, axis=-1)))


def fingers_of(values: Float[Array, "b 15 3"]) -> Float[Array, "b 5 9"]:
    """Rotation vectors finger by finger, as a prior's precision has them."""
    return values.reshape(-1, 5, 9)


def energy(frames: Frames, residual: Float[Array, "b m 3"], state: PoseState) -> Float[Array, "b"]:
    """Twice the negative log posterior of each frame, up to a constant."""
    off = fingers_of(state.vectors - frames.mean)
    prior = jnp.einsum("bfp,fpq,bfq->b", off, frames.precision, off)
    limits = jnp.sum(jnp.square(beyond(frames.ranges, state.vectors) / GIVE), axis=(1, 2))
    loss = jnp.sqrt(trust(frames, residual)) * jnp.sum(residual**2, axis=-1)
    return jnp.sum(frames.weight * loss, axis=-1) + prior + limits


def normal_equations(
    points: SkinnedPoints, frames: Frames, state: PoseState
) -> tuple[NormalBlocks, Float[Array, "b 51"], Float[Array, "b"], Float[Array, "b m 3 51"]]:
    """Normal matrix and gradient of half the energy, the energy, and the derivatives that made the matrix.

    The skin at a knuckle hangs a little on the fingers beside it. The gradient has that; the matrix, which only
    steers the step, takes each marker for its main finger's, so that fingers do not couple.
    """
    residual, jacobian = pose_jacobian(points, frames.rest, frames.centres, state, frames.observed)
    weight = frames.weight * trust(frames, residual)
    pull = jnp.einsum("fpq,bfq->bfp", frames.precision, fingers_of(state.vectors - frames.mean)).reshape(-1, 45)
    over = beyond(frames.ranges, state.vectors) / GIVE**2
    back = jnp.einsum("jka,bjk->bja", frames.ranges.axes, over).reshape(-1, 45)
    gradient = jnp.einsum("bmap,bma->bp", jacobian, weight[..., None] * residual).at[:, 6:].add(pull + back)
    finger_weight = points.weights[:, 1:].reshape(-1, 5, 3).sum(axis=-1)
    main = jax.nn.one_hot(jnp.argmax(finger_weight, axis=-1), 5)
    own = jnp.concatenate([jnp.ones((main.shape[0], 6)), jnp.repeat(main, 9, axis=1)], axis=1)
    steering = jacobian * own[:, None]
    rows = jnp.sqrt(weight)[..., None, None] * steering
    blocks = normal_blocks(rows.reshape(rows.shape[0], -1, NUM_POSE))
    stiff = jnp.einsum("jka,bjk,jkc->bjac", frames.ranges.axes, (over != 0) / GIVE**2, frames.ranges.axes)
    limits = jnp.einsum("bfjac,jk->bfjakc", stiff.reshape(-1, 5, 3, 3, 3), jnp.eye(3)).reshape(-1, 5, 9, 9)
    prior = frames.precision + limits
    return replace(blocks, fingers=blocks.fingers + prior), gradient, energy(frames, residual, state), steering


@pytree
class PoseEstimate:
    """What the solver found.

    Attributes:
        state: the poses.
        residual: predicted less observed markers, m, in the axes of the hand.
        covariance: posterior covariance of each joint's rotation vector, rad^2, at the last linearisation.
    """

    state: PoseState
    residual: Float[Any, "b m 3"]
    covariance: Float[Any, "b 15 3 3"]


@jax.jit
def solve_poses(points: SkinnedPoints, frames: Frames, state: PoseState, iterations: Int[Array, ""]) -> PoseEstimate:
    """The poses after a fixed number, one or more, of damped Gauss-Newton steps.

    A frame whose energy a step does not lower stays where it is and is damped more.
    """
    # A loop of its own: its matrix is solved in blocks, a finger each, and its weights change with the residuals.

    count = frames.observed.shape[0]

    def iterate(_: Array, carry: tuple[PoseState, Array, NormalBlocks]) -> tuple[PoseState, Array, NormalBlocks]:
        state, damping, _previous = carry
        normal, gradient, before, _derivatives = normal_equations(points, frames, state)
        step = -solve_blocks(damped(normal, damping, FLOOR), gradient[..., None])[..., 0]
        candidate = step_state(state, step)
        residual = residuals(points, frames.rest, frames.centres, candidate, frames.observed)
        better = energy(frames, residual, candidate) < before
        chosen = jax.tree.map(lambda new, old: jnp.where(_like(better, new), new, old), candidate, state)
        return chosen, damping * jnp.where(better, ACCEPTED, REJECTED), normal

    start = normal_blocks(jnp.zeros((count, 1, NUM_POSE)))
    state, _, normal = jax.lax.fori_loop(0, iterations, iterate, (state, jnp.full(count, INITIAL_DAMPING), start))
    return PoseEstimate(
        state=state,
        residual=residuals(points, frames.rest, frames.centres, state, frames.observed),
        # The last linearisation is one small step from where the poses are now.
        covariance=joint_covariance(damped(normal, jnp.zeros(count), FLOOR)),
    )


def _like(flag: Array, array: Array) -> Array:
    """`flag` (b,) with trailing axes of 1 so that it broadcasts against `array`."""
    return flag.reshape(-1, *[1] * (array.ndim - 1))
