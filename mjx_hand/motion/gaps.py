"""Filling gaps: what a motion holds in frames that were not recorded, from the frames around them."""

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.motion.resample import interpolation_index, matrix_quaternions, quaternion_matrices, slerp

Array = np.ndarray


def fill_lines(values: Float[Array, "t *d"], valid: Bool[Array, "t"]) -> Float[Array, "t *d"]:
    """`values` with straight lines across the frames that are not valid; held before the first and after the last."""
    before, after, fraction = _neighbours(valid)
    step = fraction.reshape(-1, *(1,) * (values.ndim - 1))
    return np.where(step == 0, values[before], (1 - step) * values[before] + step * values[after])


def fill_turns(quaternions: Float[Array, "t 4"], valid: Bool[Array, "t"]) -> Float[Array, "t 4"]:
    """Quaternions wxyz with great arcs across the frames that are not valid, and no sign jumps; ends held."""
    before, after, fraction = _neighbours(valid)
    matrices = quaternion_matrices(quaternions)
    return matrix_quaternions(slerp(matrices[before], matrices[after], fraction))


def _neighbours(valid: Bool[Array, "t"]) -> tuple[Array, Array, Float[Array, "t"]]:
    good = np.flatnonzero(valid)
    before, after, fraction = interpolation_index(good.astype(float), np.arange(len(valid), dtype=float))
    return good[before], good[after], fraction
