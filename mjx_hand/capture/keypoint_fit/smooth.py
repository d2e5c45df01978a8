"""Gaps and noise of keypoints, before anything is fitted to them."""

import numpy as np
from jaxtyping import Float

from mjx_hand.motion.gaps import fill_lines, short_gaps, spans
from mjx_hand.motion.smooth import check_cutoff, smooth_rows

Array = np.ndarray


def fill_short_gaps(positions: Float[Array, "t 21 3"], frames: int) -> Float[Array, "t 21 3"]:
    """Straight lines across a keypoint's gaps of at most `frames` frames; longer ones and the ends stay NaN."""
    filled, seen = positions.copy(), np.asarray(np.isfinite(positions).all(axis=2))
    short = short_gaps(seen, frames)
    for k in np.flatnonzero(seen.any(axis=0)):
        lines = fill_lines(np.where(seen[:, k, None], positions[:, k], 0.0), seen[:, k])
        filled[~seen[:, k], k] = np.nan
        filled[short[:, k], k] = lines[short[:, k]]
    return filled


def low_pass_keypoints(positions: Float[Array, "t 21 3"], fps: float, cutoff: float) -> Float[Array, "t 21 3"]:
    """Each keypoint through the zero-phase low-pass of `motion.smooth`, each stretch between its gaps by itself.

    Raises:
        InputError: the cut-off (Hz) is not between 0 and half the frame rate.
    """
    check_cutoff(cutoff, fps)
    out = positions.copy()
    for k in range(positions.shape[1]):
        for begin, end in spans(np.asarray(np.isfinite(positions[:, k]).all(axis=1))):
            out[begin:end, k] = smooth_rows(positions[begin:end, k], fps, cutoff)
    return out
