"""The baseline of the paper's Table 1: the rotation vector's components along the axes."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.projection.products import dot
from mjx_hand.rotations import log


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
