"""Poses of many frames at once: Levenberg-Marquardt on markers and prior, each frame with its own damping."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_hand.capture.linearise import NUM_POSE, PoseState, pose_jacobian, residuals, step_state
from mjx_hand.capture.skinned_points import SkinnedPoints
from mjx_hand.pytree import pytree

INITIAL_DAMPING = 1e-3  # relative to the diagonal of the normal matrix
ACCEPTED, REJECTED = 0.2, 8.0  # how the damping changes after a step
# Keeps a frame without markers solvable: far below what one marker (1e6) or the prior (at least 2) says.
FLOOR = 1e-2


@pytree
class Frames:
    """A batch of frames to fit; metres, the world shifted near each frame's markers.

    Attributes:
        observed: marker positions, zero where there is none.
        weight: inverse variance of each marker (1/m^2), zero where it is not visible.
        rest: each frame's own rest markers (its subject's shape and skin offsets).
        centres: its subject's joint centres.
        mean, precision: normal prior of the rotation vectors.
    """

    observed: Float[Array, "b m 3"]
    weight: Float[Array, "b m"]
    rest: Float[Array, "b m 3"]
    centres: Float[Array, "b 16 3"]
    mean: Float[Array, "b 15 3"]
    precision: Float[Array, "15 3 3"]


def energy(frames: Frames, residual: Float[Array, "b m 3"], state: PoseState) -> Float[Array, "b"]:
    """Twice the negative log posterior of each frame, up to a constant."""
    off = state.vectors - frames.mean
    prior = jnp.einsum("bja,jac,bjc->b", off, frames.precision, off)
    return jnp.einsum("bm,bma->b", frames.weight, residual**2) + prior


def normal_equations(
    points: SkinnedPoints, frames: Frames, state: PoseState
) -> tuple[Float[Array, "b 51 51"], Float[Array, "b 51"], Float[Array, "b"], Float[Array, "b m 3 51"]]:
    """Normal matrix and gradient of the energy's half, the energy, and the markers' derivatives."""
    residual, jacobian = pose_jacobian(points, frames.rest, frames.centres, state, frames.observed)
    root = jnp.sqrt(frames.weight)[..., None]
    rows = (root[..., None] * jacobian).reshape(residual.shape[0], -1, NUM_POSE)
    normal = jnp.einsum("brp,brq->bpq", rows, rows)
    gradient = jnp.einsum("brp,br->bp", rows, (root * residual).reshape(residual.shape[0], -1))
    blocks = jax.scipy.linalg.block_diag(jnp.zeros((6, 6)), *frames.precision)
    pull = jnp.einsum("jac,bjc->bja", frames.precision, state.vectors - frames.mean).reshape(-1, 45)
    return normal + blocks, gradient.at[:, 6:].add(pull), energy(frames, residual, state), jacobian


@jax.jit
def solve_poses(
    points: SkinnedPoints, frames: Frames, state: PoseState, iterations: int
) -> tuple[PoseState, Float[Array, "b m 3"]]:
    """The poses after a fixed number of damped Gauss-Newton steps, and their marker residuals (m, hand axes).

    A frame whose energy a step does not lower stays where it is and is damped more.
    """

    def iterate(_: int, carry: tuple[PoseState, Array]) -> tuple[PoseState, Array]:
        state, damping = carry
        normal, gradient, before, _ = normal_equations(points, frames, state)
        diagonal = jnp.einsum("bpp->bp", normal)
        damped = normal + jnp.eye(NUM_POSE) * (damping[:, None] * diagonal + FLOOR)[:, None, :]
        step = -jax.scipy.linalg.cho_solve(jax.scipy.linalg.cho_factor(damped, lower=True), gradient[..., None])
        candidate = step_state(state, step[..., 0])
        residual = residuals(points, frames.rest, frames.centres, candidate, frames.observed)
        better = energy(frames, residual, candidate) < before
        chosen = jax.tree.map(lambda new, old: jnp.where(_like(better, new), new, old), candidate, state)
        return chosen, damping * jnp.where(better, ACCEPTED, REJECTED)

    damping = jnp.full(frames.observed.shape[0], INITIAL_DAMPING)
    state, _ = jax.lax.fori_loop(0, iterations, iterate, (state, damping))
    return state, residuals(points, frames.rest, frames.centres, state, frames.observed)


def _like(flag: Array, array: Array) -> Array:
    """`flag` (b,) with trailing axes of 1 so that it broadcasts against `array`."""
    return flag.reshape(-1, *[1] * (array.ndim - 1))
