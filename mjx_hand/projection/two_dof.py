"""The exact projections of a rotation onto one hinge and onto two in series, free and within limits.

docs/projection.md derives them: sections 1, 2 and 3.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.projection.check import compose, dot, trace, turn
from mjx_hand.rotations import axis_angle_matrix, vee


def project_one_dof(
    rotation: Float[Array | np.ndarray, "*#b 3 3"], axis: Float[Array | np.ndarray, "*#b 3"]
) -> Float[Array, "*b"]:
    """The angle θ (rad, in (-π, π]) that minimises ‖R - R_a(θ)‖_F.

    θ = atan2(2 a·vee(R), tr R - a·Ra): the twist of R about a. The paper's formula (arXiv 2512.07359) has tr R - 1
    for the second argument, which is the same only where a is R's own axis.

    A half turn about an axis at right angles to `axis` is equally far from every angle: the answer is then 0.

    Args:
        rotation: rotation matrices.
        axis: unit vectors; broadcast against the batch of `rotation`.
    """
    rotation, axis = jnp.asarray(rotation), jnp.asarray(axis)
    sine = 2 * dot(vee(rotation), axis)
    cosine = trace(rotation) - dot(axis, turn(rotation, axis))
    return direction_angle(sine, cosine)


def direction_angle(sine: Float[Array, "*#b"], cosine: Float[Array, "*#b"]) -> Float[Array, "*b"]:
    """atan2 in (-π, π]; where both arguments vanish to rounding, the angle is 0 and so is its gradient."""
    vanishes = sine**2 + cosine**2 < (8 * jnp.finfo(sine.dtype).eps) ** 2
    # atan2 sees (0, 1) there, so that its gradient's division by zero cannot reach the caller as NaN.
    angle = jnp.arctan2(jnp.where(vanishes, 0.0, sine), jnp.where(vanishes, 1.0, cosine))
    return jnp.where(angle <= -jnp.pi, angle + 2 * jnp.pi, angle)  # atan2(-0, -1) is -π


def project_two_dof(
    rotation: Float[Array | np.ndarray, "*#b 3 3"],
    first_axis: Float[Array | np.ndarray, "*#b 3"],
    second_axis: Float[Array | np.ndarray, "*#b 3"],
) -> tuple[Float[Array, "*b"], Float[Array, "*b"]]:
    """The angles (φ, θ) (rad, in (-π, π]) that minimise ‖R - R_a1(φ) R_a2(θ)‖_F, for any two axes.

    Closed form and global. In quaternions the objective is uᵀN v, with u, v the unit vectors of the half angles and
    N a 2 x 2 matrix, so its maximum is N's largest singular value. The singular vectors' angles come out as

        φ = atan2((a1 x a2) · R a2, (a2 - (a1·a2) a1) · R a2),

    the turn about a1 that brings a2 in line with R a2, seen along a1; θ is the best single hinge for what is left,
    R_a1(φ)ᵀ R. The pair is unique unless N's singular values are equal: for parallel axes, or, for orthogonal ones,
    where the nearest rotation is 90 degrees away. Of the family that is then equally good, φ = 0 is returned.

    The gradients, in the rotation and in the axes, are those of the formulas, and finite at the ties too.

    Args:
        rotation: rotation matrices.
        first_axis: unit vectors of the hinge nearer the root; broadcast against the batch of `rotation`.
        second_axis: unit vectors of the hinge that follows it, as they lie while the first hinge is at 0. They
            may be at any angle to the first.
    """
    rotation, first_axis, second_axis = jnp.asarray(rotation), jnp.asarray(first_axis), jnp.asarray(second_axis)
    across = jnp.cross(first_axis, second_axis)
    along = second_axis - dot(first_axis, second_axis)[..., None] * first_axis
    moved = turn(rotation, second_axis)
    first = direction_angle(dot(across, moved), dot(along, moved))
    # θ has a formula like φ's, with the same value. Found from what is left, it stays the best for the φ in hand
    # where a near tie leaves φ to rounding.
    left = compose(axis_angle_matrix(first_axis, -first), rotation)
    return first, project_one_dof(left, second_axis)


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
