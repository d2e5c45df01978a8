"""Normal equations of a hand's pose in the form that a hand gives them: five fingers that meet only at the wrist.

Eliminating each finger (9 unknowns) and solving for the wrist (6) takes a tenth of what a dense solve of 51 unknowns
does, and it is plain array arithmetic over all frames and fingers at once. LAPACK, called for each frame, would
also start its threads for each, which stalls on a busy machine (measured: 20 times slower).
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_hand.pytree import pytree


@pytree
class NormalBlocks:
    """A symmetric positive definite matrix of 51 unknowns: wrist first, then five fingers that do not couple.

    Attributes:
        wrist: the wrist's block.
        coupling: each finger's rows against the wrist's columns.
        fingers: each finger's block.
    """

    wrist: Float[Array, "b 6 6"]
    coupling: Float[Array, "b 5 9 6"]
    fingers: Float[Array, "b 5 9 9"]


def normal_blocks(rows: Float[Array, "b r 51"]) -> NormalBlocks:
    """The blocks of rowsᵀ rows."""
    wrist = rows[..., :6]
    fingers = rows[..., 6:].reshape(*rows.shape[:2], 5, 9)
    return NormalBlocks(
        wrist=jnp.einsum("brw,brv->bwv", wrist, wrist),
        coupling=jnp.einsum("brfp,brw->bfpw", fingers, wrist),
        fingers=jnp.einsum("brfp,brfq->bfpq", fingers, fingers),
    )


def damped(blocks: NormalBlocks, relative: Float[Array, "b"], floor: float) -> NormalBlocks:
    """The blocks with `relative` times their diagonal, and `floor`, added to it."""
    wrist = jnp.einsum("bww->bw", blocks.wrist)
    fingers = jnp.einsum("bfpp->bfp", blocks.fingers)
    return NormalBlocks(
        wrist=blocks.wrist + jnp.eye(6) * (relative[:, None] * wrist + floor)[..., None],
        coupling=blocks.coupling,
        fingers=blocks.fingers + jnp.eye(9) * (relative[:, None, None] * fingers + floor)[..., None],
    )


def solve_blocks(blocks: NormalBlocks, right: Float[Array, "b 51 k"]) -> Float[Array, "b 51 k"]:
    """The solution of blocks @ x = right."""
    count = right.shape[-1]
    fingers_right = right[:, 6:].reshape(-1, 5, 9, count)
    eliminated = solve_definite(blocks.fingers, jnp.concatenate([blocks.coupling, fingers_right], axis=-1))
    by_wrist, fingers = eliminated[..., :6], eliminated[..., 6:]
    reduced = blocks.wrist - jnp.einsum("bfpw,bfpv->bwv", blocks.coupling, by_wrist)
    wrist_right = right[:, :6] - jnp.einsum("bfpw,bfpk->bwk", blocks.coupling, fingers)
    wrist = solve_definite(reduced, wrist_right)
    fingers = fingers - jnp.einsum("bfpw,bwk->bfpk", by_wrist, wrist)
    return jnp.concatenate([wrist, fingers.reshape(-1, 45, count)], axis=1)


def joint_covariance(blocks: NormalBlocks) -> Float[Array, "b 15 3 3"]:
    """The inverse's diagonal blocks of the 15 joints."""
    unit = jnp.broadcast_to(jnp.eye(9), blocks.fingers.shape)
    eliminated = solve_definite(blocks.fingers, jnp.concatenate([blocks.coupling, unit], axis=-1))
    by_wrist, inverse = eliminated[..., :6], eliminated[..., 6:]
    reduced = blocks.wrist - jnp.einsum("bfpw,bfpv->bwv", blocks.coupling, by_wrist)
    reduced = jnp.broadcast_to(reduced[:, None], (len(reduced), 5, 6, 6))
    spread = solve_definite(reduced, jnp.swapaxes(by_wrist, -1, -2))
    inverse = inverse + by_wrist @ spread
    return jnp.einsum("bfjajc->bfjac", inverse.reshape(-1, 5, 3, 3, 3, 3)).reshape(-1, 15, 3, 3)


def solve_definite(matrix: Float[Array, "*b n n"], right: Float[Array, "*b n k"]) -> Float[Array, "*b n k"]:
    """The solution of matrix @ x = right for small positive definite matrices (Gauss-Jordan; no pivots needed)."""
    size = matrix.shape[-1]
    table = jnp.concatenate([matrix, right], axis=-1)

    def eliminate(i: Array, table: Array) -> Array:
        row = jax.lax.dynamic_index_in_dim(table, i, axis=-2)
        row = row / jax.lax.dynamic_index_in_dim(row, i, axis=-1)
        column = jax.lax.dynamic_index_in_dim(table, i, axis=-1)
        chosen = (jnp.arange(size) == i)[:, None]
        return jnp.where(chosen, row, table - column * row)

    return jax.lax.fori_loop(0, size, eliminate, table)[..., size:]
