"""Keypoints at exactly 0, 0, 0: what devices and exports write where they have lost a joint or its depth."""

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.layouts import KEYPOINTS

_ORIGINS = tuple(KEYPOINTS.index(name) for name in ("wrist", "middle_mcp"))  # of recordings relative to a joint


def without_zeros(positions: Float[np.ndarray, "t 21 3"]) -> Float[np.ndarray, "t 21 3"]:
    """`positions` with NaN for keypoints at exactly 0, 0, 0.

    A wrist, or else a middle knuckle, that is there in every frame is the origin of a recording relative to it, and
    missing only where nothing else is seen.
    """
    zero = (positions == 0).all(axis=-1)
    elsewhere = np.isfinite(positions).all(axis=-1) & ~zero
    hand = elsewhere.any(axis=1)
    origin = next((k for k in _ORIGINS if hand.any() and zero[hand, k].all()), None)
    if origin is not None:
        zero[:, origin] &= ~hand
    return np.where(zero[..., None], np.nan, positions)
