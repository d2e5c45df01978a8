"""A subject's shape and skin offsets, together with the poses of a few frames (Gauss-Newton, Schur complement).

As MoSh does (Loper et al. 2014, https://doi.org/10.1145/2661229.2661273): bone lengths and where the markers were
stuck on are shared by all frames, so a few dozen frames that differ determine them.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from mjx_hand.capture.marker_fit.linearise import PoseState, residuals, step_state
from mjx_hand.capture.marker_fit.normal_blocks import NormalBlocks, damped, solve_blocks
from mjx_hand.capture.marker_fit.pose_solver import (
    ACCEPTED,
    FLOOR,
    INITIAL_DAMPING,
    REJECTED,
    Frames,
    energy,
    normal_equations,
    trust,
)
from mjx_hand.capture.marker_fit.skinned_points import SkinnedPoints, blend_points, shape_points
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


def subject_jacobian(points: SkinnedPoints, frames: Frames, vectors: Float[Array, "b 15 3"]) -> Float[Array, "b m 3 q"]:
    """Derivative of the markers by shape, then by offsets; exact, both move them linearly."""
    rotations = exp(vectors)

    def along(rest: Float[Array, "m 3"], centres: Float[Array, "16 3"]) -> Float[Array, "b m 3"]:
        rest = jnp.broadcast_to(rest, (len(vectors), *rest.shape))
        centres = jnp.broadcast_to(centres, (len(vectors), *centres.shape))
        rot, pos = link_transforms(rotations, centres)
        return blend_points(points.weights, rest, centres, rot, pos)

    by_shape = jax.vmap(along, in_axes=-1, out_axes=-1)(points.rest_directions, points.centre_directions)
    rot, _ = link_transforms(rotations, frames.centres)
    blended = jnp.einsum("mj,bjac->bmac", points.weights, rot)
    markers = blended.shape[1]
    by_offset = jnp.einsum("bmac,mn->bmanc", blended, jnp.eye(markers)).reshape(*blended.shape[:3], -1)
    return jnp.concatenate([by_shape, by_offset], axis=-1)


@pytree
class JointSystem:
    """Normal equations of poses and subject together, in the blocks that a Schur complement wants."""

    poses: NormalBlocks
    pose_gradient: Float[Array, "b 51"]
    cross: Float[Array, "b 51 q"]
    shared: Float[Array, "q q"]
    shared_gradient: Float[Array, "q"]


def joint_system(
    points: SkinnedPoints,
    frames: Frames,
    state: PoseState,
    subject: Subject,
    expected: Float[Array, "q"],
    prior: Float[Array, "q"],
) -> JointSystem:
    """Linearise about poses and subject; `prior` is the precision of shape and offsets about what is expected."""
    here = with_subject(points, frames, subject)
    normal, gradient, _, by_pose = normal_equations(points, here, state)
    by_subject = subject_jacobian(points, here, state.vectors)
    residual = residuals(points, here.rest, here.centres, state, here.observed)
    weighted = (here.weight * trust(here, residual))[..., None, None] * by_subject
    return JointSystem(
        poses=normal,
        pose_gradient=gradient,
        cross=jnp.einsum("bmap,bmaq->bpq", by_pose, weighted),
        shared=jnp.einsum("bmap,bmaq->pq", by_subject, weighted) + jnp.diag(prior),
        shared_gradient=jnp.einsum("bmaq,bma->q", weighted, residual) + prior * (flat(subject) - expected),
    )


def joint_step(system: JointSystem, damping: Float[Array, ""]) -> tuple[Float[Array, "b 51"], Float[Array, "q"]]:
    """The damped Gauss-Newton step: eliminate each frame's pose, solve for what they share, put it back."""
    batch = system.cross.shape[0]
    right = jnp.concatenate([system.cross, system.pose_gradient[..., None]], axis=-1)
    solved = solve_blocks(damped(system.poses, jnp.full(batch, damping), FLOOR), right)
    shared = system.shared + damping * jnp.diag(jnp.diag(system.shared))
    reduced = shared - jnp.einsum("bps,bpt->st", system.cross, solved[..., :-1])
    gradient = system.shared_gradient - jnp.einsum("bps,bp->s", system.cross, solved[..., -1])
    shared_step = -jnp.linalg.solve(reduced, gradient)
    return -solved[..., -1] - jnp.einsum("bps,s->bp", solved[..., :-1], shared_step), shared_step


def flat(subject: Subject) -> Float[Array, "q"]:
    """Shape, then offsets, in one row."""
    return jnp.concatenate([subject.shape, subject.offsets.ravel()])


@jax.jit
def solve_subject(
    points: SkinnedPoints,
    frames: Frames,
    state: PoseState,
    subject: Subject,
    shape_deviation: Float[Array, ""],
    offset_deviation: Float[Array, "m"],
    iterations: Int[Array, ""],
) -> tuple[Subject, PoseState]:
    """Shape, offsets and the poses of `frames`, all of one recording, after a fixed number of damped steps.

    Args:
        points: markers where the marker set puts them.
        frames: the chosen frames; their `rest` and `centres` are ignored.
        state: where to start.
        subject: where to start, and what is expected.
        shape_deviation: standard deviation of each shape coefficient about it; 1 is the model's own.
        offset_deviation: standard deviation of each component of a marker's offset, m.
        iterations: number of steps.
    """
    # A loop of its own: poses of all frames are eliminated before what they share is solved for.
    num_shape = subject.shape.shape[0]
    prior = jnp.concatenate([jnp.full(num_shape, shape_deviation**-2), jnp.repeat(offset_deviation**-2, 3)])
    expected = flat(subject)

    def total(state: PoseState, subject: Subject) -> Float[Array, ""]:
        here = with_subject(points, frames, subject)
        residual = residuals(points, here.rest, here.centres, state, here.observed)
        return energy(here, residual, state).sum() + jnp.sum(prior * (flat(subject) - expected) ** 2)

    def iterate(_: Array, carry: tuple[Subject, PoseState, Array]) -> tuple[Subject, PoseState, Array]:
        subject, state, damping = carry
        pose_step, shared_step = joint_step(joint_system(points, frames, state, subject, expected, prior), damping)
        moved = Subject(
            shape=subject.shape + shared_step[:num_shape],
            offsets=subject.offsets + shared_step[num_shape:].reshape(-1, 3),
        )
        candidate = step_state(state, pose_step)
        better = total(candidate, moved) < total(state, subject)
        subject, state = jax.tree.map(
            lambda new, old: jnp.where(better, new, old), (moved, candidate), (subject, state)
        )
        return subject, state, damping * jnp.where(better, ACCEPTED, REJECTED)

    subject, state, _ = jax.lax.fori_loop(0, iterations, iterate, (subject, state, jnp.array(INITIAL_DAMPING)))
    return subject, state
