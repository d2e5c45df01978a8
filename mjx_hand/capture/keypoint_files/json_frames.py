"""Keypoints as JSON: a list of frames, or an object with `frames` and, beside it, `fps`, `unit`, `side` and `layout`.

`json_hands` has the forms that a frame may have. A frame's `time`, `timestamp` or `t` gives the rate where `fps` is not
said; a frame that is null or empty is a gap.
"""

from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.json_hands import FrameHand, frame_hands
from mjx_hand.capture.keypoint_files.reader import KeypointReader
from mjx_hand.capture.keypoints.names import counted_keypoints, named_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording, check_keypoints
from mjx_hand.capture.keypoints.size import unit_factor
from mjx_hand.capture.keypoints.times import evenly, stated_rate
from mjx_hand.errors import InputError

_TIMES = ("time", "timestamp", "t", "timestamp_ms", "time_ms")
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
    times = [next((frame[key] for key in _TIMES if key in frame), None) for frame in frames if isinstance(frame, dict)]
    rate = next((stated_rate(path, key, said[key]) for key in _RATES if said.get(key) is not None), None)
    found = {}
    for label, course in hands.items():
        positions, layout = _positions(path, course, said.get("layout"))
        first = next(hand for hand in course if hand is not None)
        positions = positions * unit_factor(str(path), unit or said.get("unit") or first.unit or "m")
        fps = rate
        if fps is None and len(times) == len(frames) and None not in times:
            if not all(isinstance(each, int | float) for each in times):
                raise InputError(f"{path}: a frame's time is {times[0]!r}, expected a number of seconds")
            fps, positions = evenly(path, np.array(times, float), positions)
        side = first.side or (str(said.get("side", "")).lower() if len(hands) == 1 else "")
        source = path.name if len(hands) == 1 else f"{path.name} {label}"
        recording = KeypointRecording(fps=fps, positions=positions, side=side, layout=layout, source=source)
        found[label or "hand"] = check_keypoints(recording)
    return found


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
