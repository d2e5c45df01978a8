"""Filling gaps: what a motion holds in frames that were not recorded, from the frames around them."""

import numpy as np
from jaxtyping import Bool, Float, Int

from mjx_hand.motion.resample import interpolation_index, matrix_quaternions, quaternion_matrices, slerp

Array = np.ndarray


def fill_lines(values: Float[Array, "t *d"], valid: Bool[Array, "t"]) -> Float[Array, "t *d"]:
    """`values` with straight lines across the frames that are not valid; held before the first and after the last."""
    before, after, fraction = _neighbours(valid)
    step = fraction.reshape(-1, *(1,) * (values.ndim - 1))
    known = values[valid]
    return (1 - step) * known[before] + step * known[after]  # exact at both ends


def fill_turns(quaternions: Float[Array, "t 4"], valid: Bool[Array, "t"]) -> Float[Array, "t 4"]:
    """Quaternions wxyz with great arcs across the frames that are not valid, and no sign jumps; ends held."""
    before, after, fraction = _neighbours(valid)
    known = quaternion_matrices(quaternions[valid])
    return matrix_quaternions(slerp(known[before], known[after], fraction))


def _neighbours(valid: Bool[Array, "t"]) -> tuple[Int[Array, "t"], Int[Array, "t"], Float[Array, "t"]]:
    """Of each frame: the valid frames before and after it, counted among the valid ones, and the fraction between."""
    return interpolation_index(np.flatnonzero(valid).astype(float), np.arange(len(valid), dtype=float))
