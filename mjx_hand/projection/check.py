"""Refuses what is not a rotation before it can turn into a wrong angle, and multiplies rotations.

Small products are written as sums: they fuse with what follows, and no accelerator rounds them as it may a matmul.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, Shaped

from mjx_hand.errors import InputError

TOLERANCE = 1e-3  # of R Rᵀ - I and of det R - 1: looser than float32 rounding, tighter than any real mistake


def check_rotations(rotations: Shaped[Array | np.ndarray, "..."], joints: int) -> Float[Array, "*b {joints} 3 3"]:
    """The rotations as a floating JAX array; values are looked at only where they are known (not while tracing).

    Raises:
        InputError: for another shape or type, or for matrices that are not rotations.
    """
    if rotations.dtype.kind not in "fiu":
        raise InputError(f"the rotations given are of type {rotations.dtype}; real numbers are needed")
    if rotations.shape[-3:] != (joints, 3, 3):
        hint = "; turn axis-angle poses into matrices with mjx_hand.rotations.exp"
        raise InputError(
            f"the rotations given have shape {rotations.shape}; the shape must be (..., {joints}, 3, 3)"
            + (hint if rotations.shape[-1:] in ((3,), (45,)) else "")
        )
    array = jnp.asarray(rotations, None if rotations.dtype.kind == "f" else jnp.float32)
    if not isinstance(array, Tracer) and array.size:
        _check_values(array)
    return array


def _check_values(rotations: Array) -> None:
    worst, where = _worst(rotations)
    if worst <= TOLERANCE:  # false for NaN
        return
    index = ", ".join(str(int(i)) for i in np.unravel_index(int(where), rotations.shape[:-2]))
    if not np.isfinite(worst):
        raise InputError(f"rotations[{index}] is not finite; drop such frames, or fill them, before projecting")
    raise InputError(
        f"rotations[{index}] is off a rotation by {float(worst):.2g} (R Rᵀ = I and det R = 1 must hold to {TOLERANCE});"
        " orthonormalise it, or check the layout"
    )


@jax.jit
def _worst(rotations: Array) -> tuple[Array, Array]:
    """The largest deviation from R Rᵀ = I and det R = 1, and the flat index of its matrix; NaN counts as largest."""
    gram = compose(rotations, jnp.swapaxes(rotations, -1, -2)) - jnp.eye(3, dtype=rotations.dtype)
    volume = jnp.sum(jnp.cross(rotations[..., 0, :], rotations[..., 1, :]) * rotations[..., 2, :], axis=-1)
    deviation = jnp.maximum(jnp.max(jnp.abs(gram), axis=(-2, -1)), jnp.abs(volume - 1)).ravel()
    where = jnp.argmax(deviation)
    return deviation[where], where


def dot(x: Float[Array, "*#b 3"], y: Float[Array, "*#b 3"]) -> Float[Array, "*b"]:
    """The scalar product x · y."""
    return jnp.sum(x * y, axis=-1)


def turn(rotation: Float[Array, "*#b 3 3"], vector: Float[Array, "*#b 3"]) -> Float[Array, "*b 3"]:
    """The vector R x."""
    return jnp.sum(rotation * vector[..., None, :], axis=-1)


def compose(first: Float[Array, "*#b 3 3"], second: Float[Array, "*#b 3 3"]) -> Float[Array, "*b 3 3"]:
    """The matrix A B."""
    return jnp.sum(first[..., :, :, None] * second[..., None, :, :], axis=-2)


def trace(matrix: Float[Array, "*b 3 3"]) -> Float[Array, "*b"]:
    """The sum of the diagonal; `jnp.trace` masks and sums all nine entries, which costs a third of the projection."""
    return matrix[..., 0, 0] + matrix[..., 1, 1] + matrix[..., 2, 2]
