"""The hands in one frame of a JSON recording, in the forms that devices' programming interfaces give them.

- MediaPipe's results (https://ai.google.dev/edge/mediapipe/solutions/vision/hand_landmarker): `worldLandmarks` or
  `world_landmarks`, a list of 21 `{x, y, z}` for each hand. Its `handedness` is that of a mirrored image, so it only
  names the hand here; the side is told by the fingers.
- Leap's frames (https://developer-archive.leapmotion.com/documentation/javascript/api/Leap.Frame.html): `hands`, and
  `pointables` with `carpPosition` … `btipPosition`, millimetres.
- Joints by name, as WebXR, OpenXR, ARKit and Quest applications save them: `{"wrist": [x, y, z] or {x, y, z} or
  {"position": …}, …}`; also under `joints`, and hand by hand under `left` and `right` or in a list `hands`.
- A plain list of points.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mjx_hand.capture.keypoints.names import names_a_hand
from mjx_hand.capture.keypoints.recording import SIDES

_WORLD = ("worldLandmarks", "world_landmarks", "multi_hand_world_landmarks", "hand_world_landmarks")
_POINTS = (*_WORLD, "landmarks", "keypoints", "joints", "positions", "points")
_LABELS = ("handedness", "handednesses", "multi_handedness")  # MediaPipe's
_SIDE = ("side", "hand", "type", "hand_type")
_FINGERS = ("thumb", "index", "middle", "ring", "pinky")  # Leap's pointable types 0 to 4
_LEAP = ("carp", "mcp", "pip", "dip", "btip")


@dataclass(frozen=True)
class FrameHand:
    """One hand in one frame.

    Attributes:
        points: (n, 3), in the file's unit; NaN where a point is missing.
        names: of the points, empty where they are told by their order.
        side: "right", "left", or "" where not said, or not to be trusted.
        label: what the file calls the hand, else its place in the frame.
        unit: of the points, where the form fixes it.
    """

    points: np.ndarray
    names: tuple[str, ...]
    side: str
    label: str
    unit: str | None = None


def frame_hands(frame: Any) -> list[FrameHand]:
    """The hands in a frame; none where it is a gap, or of no form that is known here."""
    if isinstance(frame, dict) and "pointables" in frame:
        return _leap_hands(frame)
    return _hands(frame, "", "")


def _hands(value: Any, side: str, label: str) -> list[FrameHand]:
    points = _points(value)
    if points is not None:
        return [FrameHand(*points, side, label)]
    if isinstance(value, list):
        # Results for several hands, or a single one wrapped in a list.
        return [hand for k, each in enumerate(value) for hand in _hands(each, side, label or str(k))]
    if not isinstance(value, dict):
        return []
    both = [(key, each) for key, each in value.items() if key.lower() in SIDES and isinstance(each, dict | list)]
    if both:
        return [hand for key, each in both for hand in _hands(each, key.lower(), key.lower())]
    said = next((str(value[key]) for key in _SIDE if isinstance(value.get(key), str)), "").lower()
    side = next((known for known in SIDES if said.startswith(known)), side)
    if isinstance(value.get("hands"), list | dict):
        return _hands(value["hands"], side, label)
    key = next((key for key in _POINTS if value.get(key)), None)
    if key is None:
        return []
    labels = _labels(next((value[key] for key in _LABELS if key in value), None))
    found = _hands(value[key], side, side or label)
    if len(labels) == len(found):
        return [
            FrameHand(hand.points, hand.names, hand.side, name, hand.unit)
            for hand, name in zip(found, labels, strict=True)
        ]
    return found


def _labels(value: Any) -> list[str]:
    """MediaPipe's handedness, hand by hand, however deep its lists are nested."""
    if isinstance(value, str):
        return [value.lower()]
    if isinstance(value, list):
        return [label for each in value for label in _labels(each)]
    if isinstance(value, dict):
        for key in ("categoryName", "category_name", "label", "displayName", "classification"):
            if key in value:
                return _labels(value[key])
    return []


def _points(value: Any) -> tuple[np.ndarray, tuple[str, ...]] | None:
    """Points and names of one hand's joints; None if the value is something else."""
    if isinstance(value, dict) and names_a_hand(list(value)):
        points = [_point(each) for each in value.values()]
        kept = [(name, p) for name, p in zip(value, points, strict=True) if p is not None]
        return np.array([p for _, p in kept], dtype=float).reshape(-1, 3), tuple(name for name, _ in kept)
    if isinstance(value, list) and len(value) > 4:
        if all(isinstance(each, int | float) for each in value):
            return (np.array(value, float).reshape(-1, 3), ()) if len(value) % 3 == 0 else None
        points = [_point(each) for each in value]
        if all(p is not None for p in points):
            names = tuple(str(each["name"]) for each in value if isinstance(each, dict) and "name" in each)
            return np.array(points, dtype=float), names if len(names) == len(points) else ()
    return None


def _point(value: Any) -> list[float] | None:
    """A point's coordinates, NaN for one that is null; None if the value is no point."""
    if value is None:
        return [np.nan] * 3
    if isinstance(value, dict):
        if {"x", "y", "z"} <= set(value):
            value = [value["x"], value["y"], value["z"]]
        elif "position" in value:
            return _point(value["position"])
    if (
        isinstance(value, list)
        and len(value) == 3
        and all(each is None or isinstance(each, int | float) for each in value)
    ):
        return [np.nan if each is None else float(each) for each in value]
    return None


def _leap_hands(frame: dict) -> list[FrameHand]:
    found = []
    for hand in frame.get("hands", ()):
        fingers = {p.get("type"): p for p in frame["pointables"] if p.get("handId") == hand.get("id")}
        names, points = ["wrist"], [hand.get("wrist")]
        for kind, finger in enumerate(_FINGERS):
            names += [f"{finger}_{joint}" for joint in _LEAP]
            points += [fingers.get(kind, {}).get(f"{joint}Position") for joint in _LEAP]
        rows = [_point(p) or [np.nan] * 3 for p in points]
        side = str(hand.get("type", "")).lower()
        label = f"{side}_{hand.get('id', len(found))}"
        found.append(FrameHand(np.array(rows, float), tuple(names), side if side in SIDES else "", label, "mm"))
    return found
