"""`KeypointReport`: how far a fitted hand is from its keypoints, and how smoothly it moves."""

import warnings
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.capture.keypoints.bone_lengths import NUM_FINGER_BONES, lengths
from mjx_hand.capture.keypoints.skeleton import bone_directions

Array = np.ndarray


@dataclass(frozen=True)
class KeypointReport:
    """How well a motion explains keypoints, over its valid frames; metres and radians.

    Attributes:
        fitted: the fitted hand's own 21 keypoints in the recording's frame; NaN in frames that are not valid.
        distance: mean distance of each of the 21 keypoints from the fitted hand's; NaN for one that is never seen.
        direction: mean angle between each finger bone seen and fitted, fingers in MANO's order, knuckle outwards.
        bone_error: how much longer each finger bone is in the fitted hand than the median of what was seen.
        spread_seen, spread_fitted: how much finger bones' lengths vary over time (standard deviation over mean), the
            mean over the bones.
        jitter_seen, jitter_fitted: mean length of the keypoints' second difference over frames, of the recording and
            of the fitted hand, over the same keypoints and frames; NaN where no three frames in a row are valid.
    """

    fitted: Float[Array, "t 21 3"]
    distance: Float[Array, "21"]
    direction: Float[Array, "5 3"]
    bone_error: Float[Array, "5 3"]
    spread_seen: float
    spread_fitted: float
    jitter_seen: float
    jitter_fitted: float


def make_report(
    seen: Float[Array, "t 21 3"], fitted: Float[Array, "t 21 3"], valid: Bool[Array, "t"]
) -> KeypointReport:
    """The report on keypoints as recorded (NaN where missing) and as fitted, of which `valid` frames count."""
    mask = valid[:, None] & np.isfinite(seen).all(axis=-1)
    shown = np.where(valid[:, None, None], fitted, np.nan)
    seen = np.where(mask[..., None], seen, np.nan)
    fitted = np.where(mask[..., None], fitted, np.nan)
    before, after = lengths(seen)[:, :NUM_FINGER_BONES], lengths(fitted)[:, :NUM_FINGER_BONES]
    cosine = (bone_directions(seen) * bone_directions(fitted)).sum(axis=-1)
    sine = np.linalg.norm(np.cross(bone_directions(seen), bone_directions(fitted)), axis=-1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # means of nothing are NaN, as documented
        return KeypointReport(
            fitted=shown,
            distance=np.nanmean(np.linalg.norm(fitted - seen, axis=-1), axis=0),
            direction=np.nanmean(np.arctan2(sine, cosine), axis=0),
            bone_error=(np.nanmedian(after, axis=0) - np.nanmedian(before, axis=0)).reshape(5, 3),
            spread_seen=float(np.nanmean(np.nanstd(before, axis=0) / np.nanmean(before, axis=0))),
            spread_fitted=float(np.nanmean(np.nanstd(after, axis=0) / np.nanmean(after, axis=0))),
            jitter_seen=_jitter(seen),
            jitter_fitted=_jitter(fitted),
        )


def _jitter(positions: Float[Array, "t 21 3"]) -> float:
    if len(positions) < 3:
        return float("nan")
    return float(np.nanmean(np.linalg.norm(np.diff(positions, n=2, axis=0), axis=-1)))
