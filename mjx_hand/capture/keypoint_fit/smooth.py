"""Gaps and noise of keypoints, before anything is fitted to them."""

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.motion.gaps import fill_lines
from mjx_hand.motion.smooth import smooth_rows

Array = np.ndarray


def runs(flags: Bool[Array, "t"]) -> list[slice]:
    """The stretches of frames in which `flags` is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def fill_short_gaps(positions: Float[Array, "t 21 3"], frames: int) -> Float[Array, "t 21 3"]:
    """Straight lines across a keypoint's gaps of at most `frames` frames; longer ones and the ends stay NaN."""
    filled = positions.copy()
    for k in range(positions.shape[1]):
        seen = np.asarray(np.isfinite(positions[:, k]).all(axis=1))
        if not seen.any():
            continue
        lines = fill_lines(np.where(seen[:, None], positions[:, k], 0.0), seen)
        filled[~seen, k] = np.nan
        for gap in runs(~seen):
            inside = gap.start > 0 and gap.stop < len(seen)
            if inside and gap.stop - gap.start <= frames:
                filled[gap, k] = lines[gap]
    return filled


def low_pass_keypoints(positions: Float[Array, "t 21 3"], fps: float, cutoff: float) -> Float[Array, "t 21 3"]:
    """Each keypoint through the zero-phase low-pass of `motion.smooth`, each stretch between its gaps by itself.

    Raises:
        InputError: the cut-off (Hz) is not between 0 and half the frame rate.
    """
    if not 0 < cutoff < fps / 2:
        raise InputError(f"cut-off is {cutoff} Hz; for {fps:g} frames/s it must lie between 0 and half of that")
    out = positions.copy()
    for k in range(positions.shape[1]):
        for run in runs(np.asarray(np.isfinite(positions[:, k]).all(axis=1))):
            out[run, k] = smooth_rows(positions[run, k], fps, cutoff)
    return out
