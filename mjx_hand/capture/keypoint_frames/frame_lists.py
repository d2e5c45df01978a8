"""Where in a JSON value the frames stand, and what stands beside them."""

from typing import Any

from mjx_hand.capture.keypoint_frames.json_hands import POINTS, frame_hands, side_of, snake
from mjx_hand.capture.keypoint_frames.json_points import hand_points, is_number
from mjx_hand.capture.keypoint_frames.leap_frames import unpacked

_WRAPPERS = ("frames", "data", "results", "samples", "sequence", "recording")
_LISTS = (*_WRAPPERS, "poses", "hands", "landmarks", *POINTS)
_RATES = ("fps", "frame_rate", "rate")
_MOST_HANDS = 4  # in one frame; more are frames
_MOST_TIMES = 100  # frame numbers may leave out so many times what they name
_DEEPEST = 3


def frames_in(value: Any) -> tuple[list[Any], dict[str, Any]]:
    """The frames in a file's value, one alone too, and the object around them; no frames where there are none.

    Frames are a list, the value itself or under `frames`, `data`, … or the name of the points; an object of frames by
    their numbers; or a list for each hand under `right` and `left`.
    """
    return _frames(value, 0) or ([value], value if isinstance(value, dict) else {})


def _frames(value: Any, depth: int) -> tuple[list[Any], dict[str, Any]] | None:
    if isinstance(value, list):
        return _listed(value), {}
    if not isinstance(value, dict) or depth > _DEEPEST:
        return None
    numbered = _by_number(value)
    if numbered is not None:
        return numbered, {}
    sides = {side_of(key): each for key, each in value.items() if side_of(key) and _is_series(each)}
    if sides:
        rows = range(max(map(len, sides.values())))
        return [{side: each[k] for side, each in sides.items() if k < len(each)} for k in rows], value
    keys = {snake(key): key for key in value}
    for name in (name for name in _LISTS if name in keys):
        inner = value[keys[name]]
        if isinstance(inner, list) and (name == "frames" or _holds_frames(inner, value, keys)):
            return _listed(inner), value
        if isinstance(inner, dict) and name in _WRAPPERS and (found := _frames(inner, depth + 1)) is not None:
            return found[0], {**value, **found[1]}
    return None


def _listed(value: list[Any]) -> list[Any]:
    """The frames of a list; of one hand's points the one frame that it is."""
    return unpacked(value) if hand_points(value) is None else [value]


def _holds_frames(inner: list[Any], value: dict[str, Any], keys: dict[str, str]) -> bool:
    """Whether a list in an object is one of frames, and not of the hands in one."""
    if not _is_series(inner):
        return False
    hands = frame_hands(value)
    return not hands or len(hands) > _MOST_HANDS or any(rate in keys for rate in _RATES)


def _is_series(value: Any) -> bool:
    """Whether a list is one of frames, and not the points of one hand."""
    if not isinstance(value, list) or not value or all(is_number(each) for each in value):
        return False
    return hand_points(value) is None and any(frame_hands(each) for each in value if each)


def _by_number(value: dict[str, Any]) -> list[Any] | None:
    """Frames that are named by their numbers, null for those left out; None if they are not."""
    if not value or not all(key.isdecimal() and len(key) < 10 for key in value):
        return None
    numbers = {int(key): each for key, each in value.items()}
    first, last = min(numbers), max(numbers)
    if last - first > _MOST_TIMES * len(numbers):
        return None
    return [numbers.get(k) for k in range(first, last + 1)]
