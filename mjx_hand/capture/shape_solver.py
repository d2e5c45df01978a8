"""A subject's shape and skin offsets, together with the poses of a few frames (Gauss-Newton, Schur complement).

As MoSh does (Loper et al. 2014, https://doi.org/10.1145/2661229.2661273): bone lengths and where the markers were
stuck on are shared by all frames, so a few dozen frames that differ determine them.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_hand.capture.linearise import NUM_POSE, PoseState, residuals, step_state
from mjx_hand.capture.pose_solver import ACCEPTED, INITIAL_DAMPING, REJECTED, Frames, energy, normal_equations
from mjx_hand.capture.skinned_points import SkinnedPoints, blend_points, shape_points
from mjx_hand.hand.skinning import link_transforms
from mjx_hand.pytree import pytree, replace
from mjx_hand.rotations import exp


@pytree
class Subject:
    """What all frames of a recording share.

    Attributes:
        shape: shape coefficients, a standard normal distribution in the model.
        offsets: how far each marker at rest is from where the marker set puts it, m.
    """

    shape: Float[Array, "s"]
    offsets: Float[Array, "m 3"]


def subject_points(points: SkinnedPoints, subject: Subject) -> tuple[Float[Array, "m 3"], Float[Array, "16 3"]]:
    """The subject's rest markers and joint centres."""
    rest, centres = shape_points(points, subject.shape)
    return rest + subject.offsets, centres


def with_subject(points: SkinnedPoints, frames: Frames, subject: Subject) -> Frames:
    """The frames with every frame's rest markers and centres those of `subject`."""
    rest, centres = subject_points(points, subject)
    return replace(
        frames,
        rest=jnp.broadcast_to(rest, frames.rest.shape),
        centres=jnp.broadcast_to(centres, frames.centres.shape),
    )


def subject_jacobian(
    points: SkinnedPoints, frames: Frames, vectors: Float[Array, "b 15 3"]
) -> Float[Array, "b m 3 s+3m"]:
    """Derivative of the markers by shape, then by offsets; exact, both move them linearly."""
    rotations = exp(vectors)

    def along(rest: Float[Array, "m 3"], centres: Float[Array, "16 3"]) -> Float[Array, "b m 3"]:
        rot, pos = link_transforms(rotations, centres)
        return blend_points(points.weights, rest, centres, rot, pos)

    by_shape = jax.vmap(along, in_axes=-1, out_axes=-1)(points.rest_directions, points.centre_directions)
    rot, _ = link_transforms(rotations, frames.centres)
    blended = jnp.einsum("mj,bjac->bmac", points.weights, rot)
    markers = blended.shape[1]
    by_offset = jnp.einsum("bmac,mn->bmanc", blended, jnp.eye(markers)).reshape(*blended.shape[:3], -1)
    return jnp.concatenate([by_shape, by_offset], axis=-1)


@jax.jit
def solve_subject(
    points: SkinnedPoints, frames: Frames, state: PoseState, subject: Subject, offset_deviation: float, iterations: int
) -> tuple[Subject, PoseState]:
    """Shape, offsets and the poses of `frames`, all of one recording, after a fixed number of damped steps.

    Args:
        points: markers where the marker set puts them.
        frames: the chosen frames; their `rest` and `centres` are ignored.
        state: where to start.
        subject: where to start.
        offset_deviation: standard deviation of each component of an offset, m.
        iterations: number of steps.
    """
    num_shape = subject.shape.shape[0]
    prior = jnp.concatenate([jnp.ones(num_shape), jnp.full(subject.offsets.size, offset_deviation**-2)])

    def total(frames: Frames, state: PoseState, subject: Subject) -> Float[Array, ""]:
        residual = residuals(points, frames.rest, frames.centres, state, frames.observed)
        shared = jnp.concatenate([subject.shape, subject.offsets.ravel()])
        return energy(frames, residual, state).sum() + jnp.sum(prior * shared**2)

    def iterate(_: int, carry: tuple[Subject, PoseState, Array]) -> tuple[Subject, PoseState, Array]:
        subject, state, damping = carry
        here = with_subject(points, frames, subject)
        normal, gradient, _, by_pose = normal_equations(points, here, state)
        residual = residuals(points, here.rest, here.centres, state, here.observed)
        by_subject = subject_jacobian(points, here, state.vectors)
        count = by_subject.shape[-1]
        weighted = (here.weight[..., None, None] * by_subject).reshape(residual.shape[0], -1, count)
        flat = by_subject.reshape(weighted.shape)
        cross = jnp.einsum("brp,brs->bps", by_pose.reshape(*weighted.shape[:2], NUM_POSE), weighted)
        shared = jnp.concatenate([subject.shape, subject.offsets.ravel()])
        shared_gradient = jnp.einsum("brs,br->s", weighted, residual.reshape(residual.shape[0], -1)) + prior * shared
        shared_normal = jnp.einsum("brs,brt->st", weighted, flat) + jnp.diag(prior)
        shared_normal += damping * jnp.diag(jnp.diag(shared_normal))
        diagonal = jnp.einsum("bpp->bp", normal)
        damped = normal + jnp.eye(NUM_POSE) * (damping * diagonal + 1e-2)[:, None, :]
        factor = jax.scipy.linalg.cho_factor(damped, lower=True)
        # Eliminate each frame's pose, solve for what they share, and put it back.
        solved = jax.scipy.linalg.cho_solve(factor, jnp.concatenate([cross, gradient[..., None]], axis=-1))
        reduced = shared_normal - jnp.einsum("bps,bpt->st", cross, solved[..., :-1])
        right = shared_gradient - jnp.einsum("bps,bp->s", cross, solved[..., -1])
        shared_step = -jnp.linalg.solve(reduced, right)
        pose_step = -solved[..., -1] - jnp.einsum("bps,s->bp", solved[..., :-1], shared_step)
        moved = Subject(
            shape=subject.shape + shared_step[:num_shape],
            offsets=subject.offsets + shared_step[num_shape:].reshape(-1, 3),
        )
        candidate = step_state(state, pose_step)
        better = total(with_subject(points, frames, moved), candidate, moved) < total(here, state, subject)
        choose = lambda new, old: jnp.where(better, new, old)  # noqa: E731
        return (
            jax.tree.map(choose, moved, subject),
            jax.tree.map(choose, candidate, state),
            damping * jnp.where(better, ACCEPTED, REJECTED),
        )

    subject, state, _ = jax.lax.fori_loop(0, iterations, iterate, (subject, state, jnp.array(INITIAL_DAMPING)))
    return subject, state
