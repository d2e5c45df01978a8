"""Leap Motion's frames, as LeapJS gives them and its recorder keeps them.

A frame has `hands` and `pointables`, the fingers of all of them, in millimetres
(https://developer-archive.leapmotion.com/documentation/javascript/api/Leap.Frame.html). The recorder
(https://github.com/leapmotion/leapjs-playback) has three forms: frames with `tipPosition` and no `btipPosition`;
packed, where the first row names what every other row holds; and either without a finger's `type`, which its id tells.
"""

from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_frames.frame_hand import FrameHand
from mjx_hand.capture.keypoint_frames.json_points import is_number, place_of
from mjx_hand.capture.keypoints.recording import SIDES

_FINGERS = ("thumb", "index", "middle", "ring", "pinky")  # Leap's types 0 to 4
_JOINTS = ("carp", "mcp", "pip", "dip", "btip")


def is_leap_frame(frame: Any) -> bool:
    """Whether a frame is one of Leap's."""
    return isinstance(frame, dict) and isinstance(frame.get("pointables"), list)


def leap_hands(frame: dict[str, Any]) -> list[FrameHand]:
    """The hands in one frame, each called by its side and id."""
    found = []
    fingers = _objects(frame.get("pointables"))
    for hand in _objects(frame.get("hands")):
        number = hand.get("id", len(found))
        own = {_type(p): p for p in fingers if p.get("handId") == hand.get("id") and not p.get("tool")}
        places = {"wrist": hand.get("wrist")}
        for kind, finger in enumerate(_FINGERS):
            bones = own.get(kind, {})
            places |= {f"{finger}_{joint}": bones.get(f"{joint}Position") for joint in _JOINTS}
            if places[f"{finger}_btip"] is None:
                places[f"{finger}_btip"] = bones.get("tipPosition")
        rows = [place_of(place) or [np.nan] * 3 for place in places.values()]
        side = str(hand.get("type", "")).lower()
        side = side if side in SIDES else ""
        label = f"{side}_{str(number)[:40]}" if side else str(number)[:40]
        found.append(FrameHand(np.array(rows, float), tuple(places), side, label, "mm"))
    return [hand for hand in found if np.isfinite(hand.points).any()]


def unpacked(frames: list[Any]) -> list[Any]:
    """Frames of the recorder's packed form as objects; others as they are."""
    if not (frames and isinstance(frames[0], list) and {"pointables", "hands"} <= set(_names(frames[0]))):
        return frames
    return [_object(frames[0], row) for row in frames[1:]]


def _names(header: list[Any]) -> list[str]:
    return [name for each in header for name in ([each] if isinstance(each, str) else each if _is_inner(each) else [])]


def _is_inner(entry: Any) -> bool:
    return isinstance(entry, dict) and len(entry) == 1 and all(isinstance(v, list) for v in entry.values())


def _object(header: list[Any], row: Any) -> dict[str, Any] | None:
    """A row by the header's names; of `{name: [[…]]}` a list of objects, of `{name: […]}` one."""
    if not isinstance(row, list):
        return None
    made: dict[str, Any] = {}
    for entry, value in zip(header, row, strict=False):
        if isinstance(entry, str):
            made[entry] = value
        elif _is_inner(entry) and isinstance(value, list):
            ((name, inner),) = entry.items()
            many = bool(inner) and isinstance(inner[0], list)
            made[name] = [_object(inner[0], each) for each in value] if many else _object(inner, value)
    return made


def _type(finger: dict[str, Any]) -> int | None:
    """Which finger: as said, else by the last digit of its id."""
    said: Any = finger.get("type", finger.get("id"))
    return int(said) % 10 if is_number(said) and abs(said) < 1e9 else None


def _objects(value: Any) -> list[dict[str, Any]]:
    return [each for each in value if isinstance(each, dict)] if isinstance(value, list) else []
