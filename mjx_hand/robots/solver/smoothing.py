"""How much neighbouring frames of a recording hold each other.

`Objective.smoothness` weighs how fast degrees of freedom change: smoothness · ‖dq/dt · 1/30 s‖². At 30 frames a second
that is dex-retargeting's smoothness · ‖q_t - q_(t-1)‖²; at other rates the same motion costs the same per second.

It is there for the jitter of measurements. Frames a tenth of a second apart or more are postures of their own, whose
difference says nothing of jitter, and so is one that differs from the one before by more than any jitter.
"""

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.errors import InputError

UNIT = 1 / 30  # s; changes are weighed over this time
APART = 0.1  # s; from here on frames do not hold each other
STEP = 0.5  # rad or m; from here on a change between two frames is not held at all


def held_share(fps: float | int) -> float:
    """What the smoothness counts between two frames: the square of how often they come in `UNIT`, 0 for rare ones.

    Raises:
        InputError: `fps` is no rate.
    """
    if not 0 < fps < np.inf:
        raise InputError(f"fps is {fps}; give the frames per second, such as 30")
    return 0.0 if fps * APART < 1 + 1e-6 else float((fps * UNIT) ** 2)


def links(
    values: Float[np.ndarray, "n b"], adjacent: Bool[np.ndarray, "b"], first: Bool[np.ndarray, "b"]
) -> Float[np.ndarray, "b"]:
    """How much a frame is held to the one before it in the batch, 0 to 1 (Tukey's biweight of their difference).

    Args:
        values: the degrees of freedom, each frame's own.
        adjacent: whether the frame before it in the batch is also the one before it in time.
        first: whether it begins a recording.
    """
    change = np.abs(np.diff(values, axis=1, prepend=values[:, :1])).max(axis=0)
    like = np.clip(1 - (change / STEP) ** 2, 0, None) ** 2
    return np.where(adjacent & ~first, like, 0.0).astype(np.float32)
