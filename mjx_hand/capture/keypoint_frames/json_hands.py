"""The hands in one frame of a JSON recording, in the forms that devices' programming interfaces give them.

- MediaPipe's results (https://ai.google.dev/edge/mediapipe/solutions/vision/hand_landmarker), of every package and in
  either spelling: `worldLandmarks`, `multi_hand_world_landmarks`, `rightHandWorldLandmarks`, `keypoints3D`, as lists or
  as `{"landmark": […]}`. Its `handedness` is that of a mirrored image, so it only names the hand here; the side is told
  by the fingers. The landmarks of the image are marked as such, for those who ask how they are meant.
- Leap's frames (`leap_frames`).
- Joints by name, as WebXR, OpenXR, ARKit, MRTK and Quest applications save them (`json_points`); also under `joints`,
  `jointPositions`, `jointTransforms` or `items`, and hand by hand under `left` and `right` or in a list `hands`.
- A plain list of points.
"""

import dataclasses
import re
from typing import Any

from mjx_hand.capture.keypoint_frames.frame_hand import IMAGE, LANDMARKS, WORLD, FrameHand
from mjx_hand.capture.keypoint_frames.json_points import hand_points, is_number
from mjx_hand.capture.keypoint_frames.leap_frames import is_leap_frame, leap_hands
from mjx_hand.capture.keypoints.layouts import NUM_KEYPOINTS
from mjx_hand.capture.keypoints.recording import SIDES

POINTS = (
    *("joint_positions", "joint_transforms", "joint_poses", "hand_joints", "joints", "joints_3d", "keypoints"),
    *("positions", "points", "landmark", "items"),
)
_LABELS = ("handedness", "handednesses", "multi_handedness")
_SIDE = ("side", "hand", "type", "hand_type", "hand_side")
_HANDS = ("hands", "hand", "results")
_MEDIAPIPE = re.compile(r"(?:(right|left)_)?(multi_)?(?:(hand)_)?(?:(right|left)_)?(world_)?landmarks")
_DEEPEST = 8  # lists and objects within each other


@dataclasses.dataclass(frozen=True)
class _Said:
    """What the objects around a hand say of it."""

    side: str = ""
    label: str = ""
    form: str = ""


def frame_hands(frame: Any) -> list[FrameHand]:
    """The hands in a frame; none where it is a gap, or of no form that is known here."""
    return leap_hands(frame) if is_leap_frame(frame) else _hands(frame, _Said(), 0)


def has_world_landmarks(frame: Any) -> bool:
    """Whether a frame has a place for MediaPipe's world landmarks, be it empty."""
    return isinstance(frame, dict) and any(_landmarks(str(key))[1] == WORLD for key in frame)


def snake(key: str) -> str:
    """A key in one spelling: of `rightHandLandmarks` and `Right-hand landmarks` `right_hand_landmarks`."""
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[a-z])(?=3[dD])", "_", key)
    return re.sub(r"[^a-z0-9]+", "_", parted.lower()).strip("_")


def side_of(key: str) -> str:
    """The side that a key names, with or without the word hand; else ""."""
    plain = re.sub(r"^hand_|_hand$", "", snake(key))
    return plain if plain in SIDES else ""


def _landmarks(key: str) -> tuple[str, str]:
    """Side and form of the landmarks that a key of MediaPipe's names; the form is "" for any other key."""
    name = snake(key)
    if name == "keypoints_3d":
        return "", WORLD
    match = _MEDIAPIPE.fullmatch(name)
    if match is None:
        return "", ""
    side = match[1] or match[4] or ""
    if match[5]:
        return side, WORLD
    return side, IMAGE if match[2] or match[3] or side else LANDMARKS


def _hands(value: Any, said: _Said, depth: int) -> list[FrameHand]:
    if depth > _DEEPEST:
        return []
    points = hand_points(value)
    if points is not None:
        return [FrameHand(*points, side=said.side, label=said.label, form=said.form)]
    if isinstance(value, list) and not all(is_number(each) for each in value):
        # Results for several hands, or a single one wrapped in a list.
        labels = (dataclasses.replace(said, label=said.label or str(k)) for k in range(len(value)))
        return [hand for told, each in zip(labels, value, strict=True) for hand in _hands(each, told, depth + 1)]
    return _hands_of_object(value, said, depth) if isinstance(value, dict) else []


def _hands_of_object(value: dict[str, Any], said: _Said, depth: int) -> list[FrameHand]:
    by_side = [(side_of(key), each) for key, each in value.items() if isinstance(each, dict | list)]
    both = [hand for side, each in by_side if side for hand in _hands(each, _Said(side, side), depth + 1)]
    if both:
        return both
    keys = {snake(key): key for key in value}
    texts = [value[keys[name]].lower() for name in _SIDE if name in keys and isinstance(value[keys[name]], str)]
    told = next((side for side in SIDES for text in texts if text.startswith(side)), "")
    said = _Said(told, told, said.form) if told else said
    handed = next((value[keys[name]] for name in _LABELS if name in keys), None)
    found = _landmarks_of(value, said, isinstance(handed, list | dict), depth)
    if not found and not has_world_landmarks(value):
        inner = (value[keys[name]] for name in (*_HANDS, *POINTS) if name in keys)
        found = next((hands for each in inner if (hands := _hands(each, said, depth + 1))), [])
    if "handyRevision" in value:  # handy.js (https://github.com/stewdio/handy.js) writes whole millimetres
        found = [dataclasses.replace(hand, unit="mm") for hand in found]
    labels = _labels(handed, 0)
    return [_labelled(*each) for each in zip(found, labels, strict=True)] if len(labels) == len(found) else found


def _landmarks_of(value: dict[str, Any], said: _Said, categories: bool, depth: int) -> list[FrameHand]:
    """MediaPipe's hands: of the world where there is a place for them, else of the image.

    Args:
        value: a result.
        said: of it.
        categories: whether it has a list of `handedness`, beside which bare `landmarks` are the image's.
        depth: of the result.
    """
    world = has_world_landmarks(value)
    found: list[FrameHand] = []
    for key, each in value.items():
        side, form = _landmarks(key)
        if form and (form == WORLD or not world):
            form = IMAGE if form == LANDMARKS and categories else form
            found += _hands(each, _Said(side or said.side, side or said.label, form), depth + 1)
    return found


def _labels(value: Any, depth: int) -> list[str]:
    """MediaPipe's handedness, hand by hand, however its lists are nested."""
    if isinstance(value, str):
        return [value.lower()[:40]]
    if isinstance(value, list) and depth <= _DEEPEST:
        return [label for each in value for label in _labels(each, depth + 1)]
    if isinstance(value, dict) and depth <= _DEEPEST:
        for key in ("categoryName", "category_name", "label", "displayName", "classification"):
            if key in value:
                return _labels(value[key], depth + 1)
    return []


def _labelled(hand: FrameHand, label: str) -> FrameHand:
    """A hand by its `handedness`: MediaPipe's, of 21 points, is a mirrored image's; WebXR's is the hand's own."""
    own = label if label in SIDES and len(hand.points) != NUM_KEYPOINTS else ""
    return dataclasses.replace(hand, label=label, side=hand.side or own)
