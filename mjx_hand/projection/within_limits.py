"""The exact projections with hinges that stop at their limits: docs/projection.md, section 3."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.projection.one_dof import project_one_dof
from mjx_hand.projection.products import compose
from mjx_hand.projection.two_dof import project_two_dof
from mjx_hand.rotations import axis_angle_matrix

Angle = Float[Array | np.ndarray, "*#b"]


def nearest_within(angle: Angle, lower: Angle, upper: Angle) -> Float[Array, "*b"]:
    """The angle (rad) in [lower, upper] that is nearest to `angle` on the circle.

    For one hinge it is the exact projection within limits, if `angle` is the exact projection without them: the
    objective is a cosine of the distance to it.
    """
    angle, lower, upper = jnp.asarray(angle), jnp.asarray(lower), jnp.asarray(upper)
    middle = (lower + upper) / 2
    turns = jnp.round((angle - middle) / (2 * jnp.pi))
    return jnp.clip(angle - 2 * jnp.pi * turns, lower, upper)


def project_two_dof_within(
    rotation: Float[Array | np.ndarray, "*#b 3 3"],
    first_axis: Float[Array | np.ndarray, "*#b 3"],
    second_axis: Float[Array | np.ndarray, "*#b 3"],
    lower: Float[Array | np.ndarray, "*#b 2"],
    upper: Float[Array | np.ndarray, "*#b 2"],
) -> tuple[Float[Array, "*b"], Float[Array, "*b"]]:
    """The angles (φ, θ) (rad) within limits that minimise ‖R - R_a1(φ) R_a2(θ)‖_F; closed form and global.

    Where the free minimiser breaks a limit the best pair has one angle at a limit, as the objective has no second
    minimum inside. With that angle given, the other is a single hinge's: the best of the four is the answer.

    Args:
        rotation, first_axis, second_axis: as for `project_two_dof`.
        lower, upper: limits (rad) of φ and θ, less than 2π apart.
    """
    rotation, first_axis, second_axis = jnp.asarray(rotation), jnp.asarray(first_axis), jnp.asarray(second_axis)
    lower, upper = jnp.asarray(lower, rotation.dtype), jnp.asarray(upper, rotation.dtype)
    free = project_two_dof(rotation, first_axis, second_axis)
    first, second = (nearest_within(angle, lower[..., k], upper[..., k]) for k, angle in enumerate(free))
    pairs: list[tuple[Array, Array]] = []
    for limits in (lower, upper):
        at = jnp.broadcast_to(limits[..., 0], first.shape)
        left = compose(axis_angle_matrix(first_axis, -at), rotation)
        pairs.append((at, nearest_within(project_one_dof(left, second_axis), lower[..., 1], upper[..., 1])))
        at = jnp.broadcast_to(limits[..., 1], first.shape)
        left = compose(rotation, axis_angle_matrix(second_axis, -at))
        pairs.append((nearest_within(project_one_dof(left, first_axis), lower[..., 0], upper[..., 0]), at))
    at_first, at_second = pairs[0]
    nearest = _match(rotation, first_axis, second_axis, at_first, at_second)
    for pair in pairs[1:]:  # by selections, which fuse where an indexed choice would not
        match = _match(rotation, first_axis, second_axis, *pair)
        better = match > nearest
        at_first = jnp.where(better, pair[0], at_first)
        at_second = jnp.where(better, pair[1], at_second)
        nearest = jnp.where(better, match, nearest)
    inside = _same_angle(free[0], first) & _same_angle(free[1], second)
    return jnp.where(inside, first, at_first), jnp.where(inside, second, at_second)


def _match(rotation: Array, first_axis: Array, second_axis: Array, first: Array, second: Array) -> Array:
    """tr(Rᵀ R_a1(φ) R_a2(θ)): the larger, the nearer."""
    made = compose(axis_angle_matrix(first_axis, first), axis_angle_matrix(second_axis, second))
    return jnp.sum(made * rotation, axis=(-2, -1))


def _same_angle(a: Array, b: Array) -> Array:
    return jnp.abs(jnp.sin((a - b) / 2)) < 1e-6
