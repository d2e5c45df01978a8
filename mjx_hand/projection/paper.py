"""The projections of arXiv 2512.07359 as printed, for comparison; docs/projection.md says what is wrong with them."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.projection.naive import naive_two_dof
from mjx_hand.projection.one_dof import direction_angle
from mjx_hand.projection.products import dot, trace
from mjx_hand.rotations import log, vee

ITERATIONS = 3  # the paper's
RELAXATION = 0.5  # the paper's


def paper_one_dof(
    rotation: Float[Array | np.ndarray, "*#b 3 3"], axis: Float[Array | np.ndarray, "*#b 3"]
) -> Float[Array, "*b"]:
    """θ = atan2(a·vee(R), (tr R - 1) / 2) (rad), given as the minimiser of ‖R - R_a(θ)‖_F, which it is not."""
    rotation = jnp.asarray(rotation)
    sine = dot(vee(rotation), jnp.asarray(axis))
    return direction_angle(sine, (trace(rotation) - 1) / 2)


def paper_two_dof(
    rotation: Float[Array | np.ndarray, "*#b 3 3"],
    first_axis: Float[Array | np.ndarray, "*#b 3"],
    second_axis: Float[Array | np.ndarray, "*#b 3"],
) -> tuple[Float[Array, "*b"], Float[Array, "*b"]]:
    """(φ, θ) (rad) by Algorithm 1: a relaxed iteration on log(R) ≈ φ a1 + θ a2 + ½φθ (a1 x a2).

    The correction term is orthogonal to both axes, so that for orthogonal axes, the only ones that the paper
    constructs, every step is zero and the result is the naive one.
    """
    rotation, first_axis, second_axis = jnp.asarray(rotation), jnp.asarray(first_axis), jnp.asarray(second_axis)
    omega = log(rotation)
    across = jnp.cross(first_axis, second_axis)
    first, second = naive_two_dof(rotation, first_axis, second_axis)
    for _ in range(ITERATIONS):
        model = first[..., None] * first_axis + second[..., None] * second_axis
        residual = omega - model - (first * second / 2)[..., None] * across
        first = first + RELAXATION * dot(residual, first_axis)
        second = second + RELAXATION * dot(residual, second_axis)
    return first, second
