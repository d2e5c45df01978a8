"""Keypoints as JSON: a list of frames, or an object with `frames` and, beside it, `fps`, `unit`, `side` and `layout`.

`json_hands` has the forms that a frame may have. A frame's `time`, `timestamp` or `t` (`timestamp_ms` says a unit) and
its `frame` number are compared with the rate; a frame that is null or empty is a gap.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.json_hands import FrameHand, frame_hands
from mjx_hand.capture.keypoint_files.reader import KeypointReader
from mjx_hand.capture.keypoint_files.timed_hand import timed_hand
from mjx_hand.capture.keypoints.names import counted_keypoints, named_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.size import unit_factor
from mjx_hand.capture.timeline.clock_names import names_numbers, names_time
from mjx_hand.capture.timeline.compare_clocks import LATEST, stated_rate, timeline_of
from mjx_hand.capture.timeline.timeline import Timeline
from mjx_hand.errors import InputError

_RATES = ("fps", "frame_rate", "frameRate", "rate")


def _frames(value: Any) -> list[Any]:
    frames = value.get("frames") if isinstance(value, dict) else value
    return frames if isinstance(frames, list) else []


def _recognises(value: Any) -> bool:
    return any(frame_hands(frame) for frame in _frames(value))


def _read(path: Path, value: Any, unit: str | None) -> dict[str, KeypointRecording]:
    frames = _frames(value)
    said = value if isinstance(value, dict) else {}
    hands: dict[str, list[FrameHand | None]] = {}
    for k, frame in enumerate(frames):
        for hand in frame_hands(frame):
            course = hands.setdefault(hand.label, [None] * len(frames))
            if course[k] is not None:
                raise InputError(f"{path}: frame {k} has two hands called {hand.label!r}; keep one, or name them apart")
            course[k] = hand
    rows, timeline = _timeline(path, said, frames)
    found = {}
    for label, course in hands.items():
        positions, layout = _positions(path, course, said.get("layout"))
        first = next(hand for hand in course if hand is not None)
        positions = positions * unit_factor(str(path), unit or said.get("unit") or first.unit or "m")
        side = first.side or (str(said.get("side", "")).lower() if len(hands) == 1 else "")
        source = path.name if len(hands) == 1 else f"{path.name} {label}"
        found[label or "hand"] = timed_hand(path, positions[rows], timeline, side=side, layout=layout, source=source)
    return found


def _timeline(path: Path, said: dict[str, Any], frames: list[Any]) -> tuple[np.ndarray, Timeline]:
    """The rows that count, and when they were taken. A null between frames that have times says nothing itself."""
    times, name = _stamps(path, frames, names_time, "time")
    numbers, _ = _stamps(path, frames, names_numbers, "number")
    rate = next((stated_rate(path, key, said[key]) for key in _RATES if said.get(key) is not None), None)
    stamps = times if times is not None else numbers
    rows = np.arange(len(frames))
    if stamps is not None:
        rows = np.array([k for k, frame in enumerate(frames) if frame])
    return rows, timeline_of(
        path,
        len(rows),
        rate=rate,
        times=None if times is None else times[rows],
        name=name,
        numbers=None if numbers is None else numbers[rows],
    )


def _stamps(path: Path, frames: list[Any], named: Callable[[str], bool], what: str) -> tuple[np.ndarray | None, str]:
    """Each frame's time or number, NaN for frames that are null, and what it is called; None where a frame lacks it."""
    stamps, name = np.full(len(frames), np.nan), ""
    for k, frame in enumerate(frames):
        if not frame:
            continue
        keys = [key for key in frame if named(key) and _alone(frame[key])] if isinstance(frame, dict) else []
        if not keys:
            return None, ""
        name, value = keys[0], frame[keys[0]]
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"{path}: a frame's {what} is {value!r}, expected a number"[:300])
        stamps[k] = float(value) if abs(value) < LATEST else np.inf
    return stamps, name


def _alone(value: Any) -> bool:
    return value is not None and not isinstance(value, dict | list)


def _positions(path: Path, course: list[FrameHand | None], layout: str | None) -> tuple[np.ndarray, str]:
    """The 21 keypoints in each frame, NaN where the hand is not there, and the layout's name."""
    seen = [(k, hand) for k, hand in enumerate(course) if hand is not None]
    names = list(dict.fromkeys(name for _, hand in seen for name in hand.names))
    width = len(names) or len(seen[0][1].points)
    points = np.full((len(course), width, 3), np.nan)
    for k, hand in seen:
        rows = [names.index(name) for name in hand.names] if names else list(range(width))
        if len(rows) != len(hand.points):
            raise InputError(f"{path}: frame {k} has {len(hand.points)} points where the first has {width}")
        points[k, rows] = hand.points
    points[~np.isfinite(points)] = np.nan
    return named_keypoints(path, names, points) if names else counted_keypoints(path, points, layout)


READER = KeypointReader(
    name="keypoint frames (MediaPipe, Leap, WebXR, OpenXR, ARKit, Quest)",
    suffix=".json",
    recognises=_recognises,
    read=_read,
)
