"""Where each device's hand keypoints go among the 21 that the project works with.

The 21 are MediaPipe's (https://ai.google.dev/edge/mediapipe/solutions/vision/hand_landmarker): the wrist, then thumb,
index, middle, ring and little finger, each from its base joint to its tip. Arrays are (..., 21, 3) metres; a keypoint
that is missing, in a frame or in the whole layout, is NaN.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.hand.joints import FINGERS

DIGITS = ("thumb", "index", "middle", "ring", "little")  # keypoints' order; MANO's is hand.joints.FINGERS
KEYPOINTS = (
    "wrist",
    *(f"thumb_{joint}" for joint in ("cmc", "mcp", "ip", "tip")),
    *(f"{digit}_{joint}" for digit in DIGITS[1:] for joint in ("mcp", "pip", "dip", "tip")),
)
NUM_KEYPOINTS = len(KEYPOINTS)  # 21
PALM = (0, 1, 5, 9, 13, 17)  # the wrist and the five base joints, which the palm carries

_MANO_FINGERS = ("thumb", "index", "middle", "ring", "pinky")  # MANO's names of the digits
# The keypoint of each of MANO's 16 joints and five finger tips, in their orders; and of each keypoint its place among
# the 16 joints followed by the five tips.
LINK_KEYPOINTS = (0, *(1 + 4 * _MANO_FINGERS.index(finger) + k for finger in FINGERS for k in range(3)))
TIP_KEYPOINTS = tuple(4 + 4 * _MANO_FINGERS.index(finger) for finger in FINGERS)
_PLACES = tuple((*LINK_KEYPOINTS, *TIP_KEYPOINTS).index(k) for k in range(NUM_KEYPOINTS))


def hand_keypoints(joints: Float[Array | np.ndarray, "*b 16 3"], tips: Float[Array | np.ndarray, "*b 5 3"]) -> Array:
    """The 21 keypoints (*b, 21, 3) of a MANO-layout hand, from joint centres (`LINKS`) and finger tips (`FINGERS`)."""
    return jnp.concatenate([jnp.asarray(joints), jnp.asarray(tips)], axis=-2)[..., list(_PLACES), :]


@dataclass(frozen=True)
class KeypointLayout:
    """A device's keypoints: their names in its own order, and which of them are the 21.

    Attributes:
        name: what it is called in files and messages.
        joints: the device's names, in the order of its arrays.
        keypoints: of each of the 21, the device's name; None where the device has no such point.
    """

    name: str
    joints: tuple[str, ...]
    keypoints: tuple[str | None, ...]

    def __post_init__(self) -> None:
        assert len(self.keypoints) == NUM_KEYPOINTS

    @property
    def indices(self) -> tuple[int, ...]:
        """Row of each of the 21 in the device's array; -1 where it has none."""
        return tuple(-1 if name is None else self.joints.index(name) for name in self.keypoints)


def to_keypoints(points: Float[np.ndarray, "*b n 3"], layout: KeypointLayout) -> Float[np.ndarray, "*b 21 3"]:
    """The 21 keypoints among a device's points; NaN where the device has none."""
    indices = np.array(layout.indices)
    found = np.asarray(points)[..., indices, :]
    return np.where((indices >= 0)[:, None], found, np.nan)


def from_keypoints(keypoints: Float[np.ndarray, "*b 21 3"], layout: KeypointLayout) -> Float[np.ndarray, "*b n 3"]:
    """A device's points from the 21; NaN for those that are not among them."""
    points = np.full((*keypoints.shape[:-2], len(layout.joints), 3), np.nan)
    for k, index in enumerate(layout.indices):
        if index >= 0:
            points[..., index, :] = keypoints[..., k, :]
    return points


def _fingers(*names: str) -> tuple[str, ...]:
    """Every name of a finger's chain, finger by finger."""
    return tuple(name.format(d=digit) for digit in DIGITS[1:] for name in names)


_VISION = (
    "wrist",
    *("thumbCMC", "thumbMP", "thumbIP", "thumbTip"),
    *_fingers("{d}MCP", "{d}PIP", "{d}DIP", "{d}Tip"),
)
_LEAP = tuple(f"{d}_{joint}" for d in _MANO_FINGERS for joint in ("mcp", "pip", "dip", "tip"))
_LEAP_BONES = (
    "wrist",
    *(f"{d}_{joint}" for d in _MANO_FINGERS for joint in ("carp", "mcp", "pip", "dip", "btip")),
)
_WEBXR = (
    "wrist",
    *("thumb-metacarpal", "thumb-phalanx-proximal", "thumb-phalanx-distal", "thumb-tip"),
    *(
        f"{d}-finger-{joint}"
        for d in ("index", "middle", "ring", "pinky")
        for joint in ("metacarpal", "phalanx-proximal", "phalanx-intermediate", "phalanx-distal", "tip")
    ),
)
_OPENXR = (
    "palm",
    "wrist",
    *("thumb_metacarpal", "thumb_proximal", "thumb_distal", "thumb_tip"),
    *_fingers("{d}_metacarpal", "{d}_proximal", "{d}_intermediate", "{d}_distal", "{d}_tip"),
)
_ARKIT = (
    "wrist",
    *("thumbKnuckle", "thumbIntermediateBase", "thumbIntermediateTip", "thumbTip"),
    *_fingers(
        "{d}FingerMetacarpal",
        "{d}FingerKnuckle",
        "{d}FingerIntermediateBase",
        "{d}FingerIntermediateTip",
        "{d}FingerTip",
    ),
    "forearmWrist",
    "forearmArm",
)
_QUEST = (
    *("Hand_WristRoot", "Hand_ForearmStub"),
    *("Hand_Thumb0", "Hand_Thumb1", "Hand_Thumb2", "Hand_Thumb3"),
    *(f"Hand_{d}{k}" for d in ("Index", "Middle", "Ring") for k in (1, 2, 3)),
    *(f"Hand_Pinky{k}" for k in (0, 1, 2, 3)),
    *(f"Hand_{d}Tip" for d in ("Thumb", "Index", "Middle", "Ring", "Pinky")),
)
_MRTK = (
    *("Palm", "Wrist"),
    *("ThumbMetacarpalJoint", "ThumbProximalJoint", "ThumbDistalJoint", "ThumbTip"),
    *(
        f"{d}{joint}"
        for d in ("Index", "Middle", "Ring", "Pinky")
        for joint in ("Metacarpal", "Knuckle", "MiddleJoint", "DistalJoint", "Tip")
    ),
)
_METACARPALS = ("IndexMetacarpal", "MiddleMetacarpal", "RingMetacarpal", "PinkyMetacarpal")
_MANO = ("wrist", *(f"{finger}{k}" for finger in FINGERS for k in (1, 2, 3)))
_MANO_DIGITS = tuple(f"{finger}{k}" if k < 4 else f"{finger}_tip" for finger in _MANO_FINGERS for k in (1, 2, 3, 4))


def _without(names: tuple[str, ...], *parts: str) -> tuple[str, ...]:
    return tuple(name for name in names if not any(part in name for part in parts))


# Leap's thumb has no metacarpal of its own: its "mcp" is the joint that anatomy calls CMC. In the XR layouts a joint is
# named after the bone that begins there, so a "proximal" is an MCP and the thumb's "metacarpal" its CMC; a finger's
# metacarpal begins in the palm and is not among the 21. Quest's Thumb0 is the trapezium, below the CMC. MANO's joints
# are its 16 links, the tips behind them in one of two orders: SMPL-X's and manopth's, or the links' own.
LAYOUTS: dict[str, KeypointLayout] = {
    layout.name: layout
    for layout in (
        KeypointLayout("mediapipe", KEYPOINTS, KEYPOINTS),
        KeypointLayout("vision", _VISION, _VISION),
        KeypointLayout("leap", _LEAP, (None, *_LEAP)),
        KeypointLayout("leap_bones", _LEAP_BONES, _without(_LEAP_BONES, "_carp")),
        KeypointLayout("webxr", _WEBXR, _without(_WEBXR, "finger-metacarpal")),
        KeypointLayout(
            "openxr", _OPENXR, ("wrist", "thumb_metacarpal", *_without(_OPENXR, "palm", "wrist", "_metacarpal"))
        ),
        KeypointLayout("arkit", _ARKIT, _without(_ARKIT, "Metacarpal", "forearm")),
        KeypointLayout("mrtk", _MRTK, _without(_MRTK, "Palm", *_METACARPALS)),
        KeypointLayout("mano", (*_MANO, *(f"{d}_tip" for d in _MANO_FINGERS)), ("wrist", *_MANO_DIGITS)),
        KeypointLayout("mano_index_first", (*_MANO, *(f"{d}_tip" for d in FINGERS)), ("wrist", *_MANO_DIGITS)),
        KeypointLayout(
            "quest",
            _QUEST,
            (
                "Hand_WristRoot",
                *("Hand_Thumb1", "Hand_Thumb2", "Hand_Thumb3", "Hand_ThumbTip"),
                *(f"Hand_{d}{k}" for d in ("Index", "Middle", "Ring", "Pinky") for k in (1, 2, 3, "Tip")),
            ),
        ),
    )
}
