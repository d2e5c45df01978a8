"""Many small positive definite systems at once, written out so that they fuse and need no call a system."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def solve_positive(matrix: Float[Array, "*b n n"], right: Float[Array, "*b n"]) -> Float[Array, "*b n"]:
    """x with A x = b for symmetric positive definite A, by Cholesky's factors without square roots (L D Lᵀ)."""
    size = right.shape[-1]
    lower: list[list[Array]] = [[] for _ in range(size)]
    pivot: list[Array] = []
    for i in range(size):
        for j in range(i):
            above = sum((lower[i][k] * lower[j][k] * pivot[k] for k in range(j)), jnp.zeros_like(right[..., 0]))
            lower[i].append((matrix[..., i, j] - above) / pivot[j])
        pivot.append(matrix[..., i, i] - sum((lower[i][k] ** 2 * pivot[k] for k in range(i)), 0.0))
    found: list[Array] = []
    for i in range(size):
        found.append(right[..., i] - sum((lower[i][k] * found[k] for k in range(i)), 0.0))
    found = [value / d for value, d in zip(found, pivot, strict=True)]
    for i in reversed(range(size)):
        found[i] = found[i] - sum((lower[k][i] * found[k] for k in range(i + 1, size)), 0.0)
    return jnp.stack(found, axis=-1)
