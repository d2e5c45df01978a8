"""Right hand or left, from where the fingers bend to."""

import warnings

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.skeleton import bone_directions
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS

_LEFT_HANDED = ("quest", "mrtk")  # layouts of Unity's packages
LEAST_BEND = np.deg2rad(3.0)  # mean bend (rad) below which a hand is too flat to tell
_FOUR = [k for k, finger in enumerate(FINGERS) if finger != "thumb"]  # a thumb also bends across the palm
_INDEX, _LITTLE = KEYPOINTS.index("index_mcp"), KEYPOINTS.index("little_mcp")


def bend_towards_right(positions: Float[np.ndarray, "t 21 3"]) -> float:
    """Mean bend (rad) of the four fingers' outer joints as a right hand's, NaN where none is seen.

    Seen along the knuckles from the little finger to the index finger, a right hand's fingers close
    counterclockwise and a left hand's clockwise: negative for a left hand, near zero for one held flat.
    """
    return float(_mean(_outer_bends(positions).reshape(1, -1))[0])


def bends_towards_right(positions: Float[np.ndarray, "t 21 3"]) -> Float[np.ndarray, "t"]:
    """`bend_towards_right` of each frame by itself."""
    return _mean(_outer_bends(positions).reshape(len(positions), -1))


def _outer_bends(positions: Float[np.ndarray, "t 21 3"]) -> Float[np.ndarray, "t 4 2"]:
    bones = bone_directions(positions)[:, _FOUR]
    across = positions[:, _INDEX] - positions[:, _LITTLE]
    with np.errstate(invalid="ignore", divide="ignore"):
        across = across / np.linalg.norm(across, axis=-1, keepdims=True)
    sine = (np.cross(bones[:, :, :-1], bones[:, :, 1:]) * across[:, None, None]).sum(axis=-1)
    cosine = (bones[:, :, :-1] * bones[:, :, 1:]).sum(axis=-1)
    return np.arctan2(sine, cosine)


def _mean(values: Float[np.ndarray, "t n"]) -> Float[np.ndarray, "t"]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # the mean of nothing is NaN, as documented
        return np.asarray(np.nanmean(values, axis=-1))


def bent_side(positions: Float[np.ndarray, "t 21 3"]) -> str:
    """The side as the fingers bend: "right", "left", or "" where the hand is held too flat to tell."""
    bend = bend_towards_right(positions)
    if not abs(bend) >= LEAST_BEND:
        return ""
    return "right" if bend > 0 else "left"


def known_side(recording: KeypointRecording, asked: str | None = None) -> tuple[str, str]:
    """The hand's side, and how it is known (for people): as asked, as recorded, or as its fingers bend.

    Raises:
        InputError: the fingers bend as the other hand's do (wrong side, or axes of a left-handed frame), or nobody
            says and the hand is held too flat to tell.
    """
    name = recording.source or "keypoints"
    seen = bent_side(recording.positions)
    said = asked or recording.side
    if said and seen and said != seen:
        bend = bend_towards_right(recording.positions)
        raise InputError(
            f"{name}: said to be a {said} hand, but its fingers bend as a {seen} hand's ({np.rad2deg(abs(bend)):.0f} "
            f"degrees on average); give side={seen!r}, or negate one axis if the frame is left-handed (Unity)"
        )
    if not (said or seen):
        raise InputError(
            f"{name}: does not say which hand it is, and holds it too flat to tell; give side='right' or side='left'"
        )
    if said:
        return said, "as asked" if asked else "as recorded"
    # A hand in left-handed axes is the other hand's mirror image in every way: nothing in it would tell.
    if recording.layout in _LEFT_HANDED:
        how = f"as its fingers bend in right-handed axes; in Unity's, as {recording.layout} often has, it is the other"
    else:
        how = "as its fingers bend"
    return seen, how
