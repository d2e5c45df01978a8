"""Gaps: where they are, and what a motion holds in frames that were not recorded, from the frames around them."""

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


def spans(flags: Bool[Array, "t"]) -> list[tuple[int, int]]:
    """First frame and the one behind the last of every run that is True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def short_gaps(visible: Bool[Array, "t m"], longest: int) -> Bool[Array, "t m"]:
    """Frames of gaps of up to `longest` frames that lie between two sights of the same point."""
    frame = np.arange(len(visible))[:, None]
    last = np.maximum.accumulate(np.where(visible, frame, -1), axis=0)
    following = np.minimum.accumulate(np.where(visible, frame, len(visible))[::-1], axis=0)[::-1]
    inside = (last >= 0) & (following < len(visible))
    return ~visible & inside & (following - last - 1 <= longest)


def _neighbours(valid: Bool[Array, "t"]) -> tuple[Int[Array, "t"], Int[Array, "t"], Float[Array, "t"]]:
    """Of each frame: the valid frames before and after it, counted among the valid ones, and the fraction between."""
    return interpolation_index(np.flatnonzero(valid).astype(float), np.arange(len(valid), dtype=float))
