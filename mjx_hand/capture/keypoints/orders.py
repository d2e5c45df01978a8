"""In which of their orders 21 points without names stand: the one in which they have the bones of a hand."""

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.bone_lengths import lengths, mean_lengths
from mjx_hand.capture.keypoints.layouts import LAYOUTS, NUM_KEYPOINTS, KeypointLayout, to_keypoints

_ORDERS = ("mediapipe", "mano", "mano_index_first")  # the usual one first
_CLEARLY = 0.5  # share of the usual order's misfit below which another one is it
_FRAMES = 200  # looked at, spread over the recording


def order_of(points: Float[np.ndarray, "*b 21 3"]) -> KeypointLayout:
    """The layout of 21 points: MediaPipe's, unless in MANO's order the bones are far more like a hand's.

    In a wrong order some of the supposed bones run from finger to finger: they are of other lengths than a hand's, and
    change as it moves.
    """
    points = points.reshape(-1, NUM_KEYPOINTS, 3)
    points = points[:: max(1, len(points) // _FRAMES)]
    misfits = {name: _misfit(to_keypoints(points, LAYOUTS[name])) for name in _ORDERS}
    best = min(misfits, key=lambda name: misfits[name])
    usual = misfits[_ORDERS[0]]
    return LAYOUTS[best if misfits[best] < _CLEARLY * usual else _ORDERS[0]]


def _misfit(keypoints: Float[np.ndarray, "t 21 3"]) -> float:
    """How far (as a logarithm) lengths are from the mean hand's, its size aside, in any frame; infinite if unknown."""
    seen = lengths(keypoints)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(seen / mean_lengths())
    ratio[~np.isfinite(ratio)] = np.nan
    known = np.isfinite(ratio)
    if not known.any():
        return np.inf
    return float(np.abs(ratio - np.median(ratio[known]))[known].mean())
