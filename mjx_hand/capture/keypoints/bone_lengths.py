"""Bone lengths from keypoints, and the hand shape that has them."""

import warnings
from functools import cache

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.capture.keypoints.skeleton import BONES, rest_keypoints
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.model import HandModel

_PALM = (
    *(("wrist", f"{digit}_mcp") for digit in ("index", "middle", "ring", "little")),
    *(("wrist", "thumb_cmc"), ("thumb_cmc", "index_mcp"), ("thumb_cmc", "little_mcp")),
    *(("index_mcp", "middle_mcp"), ("middle_mcp", "ring_mcp"), ("ring_mcp", "little_mcp"), ("index_mcp", "little_mcp")),
)
NUM_FINGER_BONES = BONES.shape[0] * BONES.shape[1]  # the first 15 lengths; the others are distances across the palm
PAIRS = np.concatenate([BONES.reshape(-1, 2), [[KEYPOINTS.index(a), KEYPOINTS.index(b)] for a, b in _PALM]])
_TIP = np.arange(NUM_FINGER_BONES) % 3 == 2
# How far (m) a device's idea of a bone's end may be from the hand model's. A finger ends at its skin or at its bone;
# where the wrist and the bases of the fingers lie inside the palm is a matter of definition too.
DEVIATION = np.concatenate([np.where(_TIP, 0.006, 0.003), np.full(len(_PALM), 0.006)])
MAX_SHAPE = 10  # coefficients fitted: 26 lengths see no more
STEPS = 8


def lengths(keypoints: Float[np.ndarray, "*b 21 3"]) -> Float[np.ndarray, "*b n"]:
    """The distances (m) between the `PAIRS` of keypoints; NaN where one is missing."""
    return np.linalg.norm(keypoints[..., PAIRS[:, 1], :] - keypoints[..., PAIRS[:, 0], :], axis=-1)


def median_lengths(positions: Float[np.ndarray, "t 21 3"]) -> Float[np.ndarray, "n"]:
    """The median over the frames of each of `lengths`, which outliers do not move; NaN for one that was never seen."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # all NaN, as documented
        return np.nanmedian(lengths(positions), axis=0)


@cache
def mean_lengths() -> Float[np.ndarray, "n"]:
    """The `lengths` (m) of the open hand's mean shape."""
    return lengths(rest_keypoints(load_hand())[0])


def shape_of_lengths(hand: HandModel, observed: Float[np.ndarray, "n"]) -> Float[np.ndarray, "s"]:
    """The most probable shape coefficients of a hand with these lengths (m), NaN for those not known.

    Least squares on the lengths, each in units of its `DEVIATION`, with the coefficients' own unit variance as the
    prior; Gauss-Newton.
    """
    mean, change = rest_keypoints(hand)
    change = change[..., :MAX_SHAPE]
    known = np.isfinite(observed)
    start, end = PAIRS[known].T
    shape = np.zeros(change.shape[-1])
    for _ in range(STEPS):
        keypoints = mean + change @ shape
        span = keypoints[end] - keypoints[start]
        length = np.linalg.norm(span, axis=-1)
        slope = np.einsum("nc,ncs->ns", span / length[:, None], change[end] - change[start])
        scaled = slope / DEVIATION[known, None]
        right = scaled.T @ ((observed[known] - length) / DEVIATION[known]) - shape
        shape = shape + np.linalg.solve(scaled.T @ scaled + np.eye(len(shape)), right)
    return shape
