"""The exact projection of a rotation onto two hinges in series: docs/projection.md, section 2."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.projection.one_dof import direction_angle, project_one_dof
from mjx_hand.projection.products import compose, dot, turn
from mjx_hand.rotations import axis_angle_matrix


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
