"""What the paper's iteration would need: the Baker-Campbell-Hausdorff series one order further."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.projection.naive import naive_two_dof
from mjx_hand.projection.products import dot
from mjx_hand.rotations import log

ITERATIONS = 4  # the fourth changes less than the terms that the series leaves out


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
    for _ in range(ITERATIONS):
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
