"""Small products written as sums: they fuse with what follows, and no accelerator rounds them as it may a matmul."""

import jax.numpy as jnp
from jaxtyping import Array, Float


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
