"""Projections for comparison: those of arXiv 2512.07359 as printed, its baseline, and its series one order further.

docs/projection.md says what is wrong with the paper's. The baseline (its Table 1) takes the rotation vector's
components along the axes; the Baker-Campbell-Hausdorff series one order further is what its iteration would need.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.projection.check import dot, trace
from mjx_hand.projection.two_dof import direction_angle
from mjx_hand.rotations import log, vee


def naive_one_dof(
    rotation: Float[Array | np.ndarray, "*#b 3 3"], axis: Float[Array | np.ndarray, "*#b 3"]
) -> Float[Array, "*b"]:
    """θ = log(R) · a (rad)."""
    return dot(log(jnp.asarray(rotation)), jnp.asarray(axis))


def naive_two_dof(
    rotation: Float[Array | np.ndarray, "*#b 3 3"],
    first_axis: Float[Array | np.ndarray, "*#b 3"],
    second_axis: Float[Array | np.ndarray, "*#b 3"],
) -> tuple[Float[Array, "*b"], Float[Array, "*b"]]:
    """φ = log(R) · a1 and θ = log(R) · a2 (rad): as if rotations about the two axes commuted."""
    omega = log(jnp.asarray(rotation))
    return dot(omega, jnp.asarray(first_axis)), dot(omega, jnp.asarray(second_axis))


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


BCH_ITERATIONS = 4  # the fourth changes less than the terms that the series leaves out


def bch2_two_dof(
    rotation: Float[Array | np.ndarray, "*#b 3 3"],
    first_axis: Float[Array | np.ndarray, "*#b 3"],
    second_axis: Float[Array | np.ndarray, "*#b 3"],
) -> tuple[Float[Array, "*b"], Float[Array, "*b"]]:
    """(φ, θ) (rad) by iteration on the series of log(R_a1(φ) R_a2(θ)) up to the terms of third order.

    φ a1 + θ a2 + ½φθ a1 x a2 + φ²θ/12 a1 x (a1 x a2) - φθ²/12 a2 x (a1 x a2). For orthogonal axes the last two are
    -φ²θ/12 a2 and -φθ²/12 a1: the first corrections that lie along the axes. Each step removes the part of the
    residual that the axes span. Good for small angles; the exact closed form is better and cheaper.
    """
    rotation, first_axis, second_axis = jnp.asarray(rotation), jnp.asarray(first_axis), jnp.asarray(second_axis)
    omega = log(rotation)
    across = jnp.cross(first_axis, second_axis)
    first_across, second_across = jnp.cross(first_axis, across), jnp.cross(second_axis, across)
    overlap = dot(first_axis, second_axis)
    gram = jnp.maximum(1 - overlap**2, jnp.finfo(omega.dtype).eps)  # parallel axes stay at the naive answer
    first, second = naive_two_dof(rotation, first_axis, second_axis)
    for _ in range(BCH_ITERATIONS):
        product = first * second
        terms = ((first, first_axis), (second, second_axis), (product / 2, across))
        terms += ((first * product / 12, first_across), (-second * product / 12, second_across))
        residual = omega - sum(size[..., None] * direction for size, direction in terms)
        along_first, along_second = dot(residual, first_axis), dot(residual, second_axis)
        # Wrapped, because the cubic terms run away where the series does not converge.
        first = wrap(first + (along_first - overlap * along_second) / gram)
        second = wrap(second + (along_second - overlap * along_first) / gram)
    return first, second


def wrap(angle: Float[Array, "*b"]) -> Float[Array, "*b"]:
    """The same angle in [-π, π)."""
    return jnp.mod(angle + jnp.pi, 2 * jnp.pi) - jnp.pi
