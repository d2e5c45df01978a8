"""Keypoints as JSON: a list of frames, an object with `frames` and, beside it, `fps`, `unit`, `side` and `layout`, or
one frame alone.

`json_hands` has the forms that a frame may have, `frame_lists` where the frames stand. A frame's `time`, `timestamp` or
`t` (`timestamp_ms` says a unit) and its `frame` number are compared with the rate; a frame that is null or empty is a
gap.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.reader import VALUE, KeypointReader
from mjx_hand.capture.keypoint_frames.assemble import recordings
from mjx_hand.capture.keypoint_frames.frame_lists import frames_in
from mjx_hand.capture.keypoint_frames.json_hands import frame_hands, has_world_landmarks
from mjx_hand.capture.keypoint_frames.leap_frames import is_leap_frame
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.timeline.clock_names import names_numbers, names_time
from mjx_hand.capture.timeline.compare_clocks import LATEST, stated_rate, timeline_of
from mjx_hand.capture.timeline.timeline import Timeline
from mjx_hand.errors import InputError

_RATES = ("fps", "frame_rate", "frameRate", "rate")


def _recognises(value: Any) -> bool:
    frames, _ = frames_in(value)
    return any(is_leap_frame(frame) or has_world_landmarks(frame) or frame_hands(frame) for frame in frames)


def _read(path: Path, value: Any, unit: str | None) -> dict[str, KeypointRecording]:
    frames, said = frames_in(value)
    rows, timeline = _timeline(path, said, frames)
    return recordings(path, [frame_hands(frames[k]) for k in rows], timeline, said, unit)


def _timeline(path: Path, said: dict[str, Any], frames: list[Any]) -> tuple[np.ndarray, Timeline]:
    """The rows that count, and when they were taken. A null between frames that have times says nothing itself."""
    times, name = _stamps(path, frames, names_time, "time")
    numbers, _ = _stamps(path, frames, names_numbers, "number")
    rate = next((stated_rate(path, key, said[key]) for key in _RATES if said.get(key) is not None), None)
    if any(isinstance(frame, dict) and "handyRevision" in frame for frame in frames):
        times = None  # of separate postures, no motion
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


READER = KeypointReader(
    name="keypoint frames (MediaPipe, Leap, WebXR, OpenXR, ARKit, MRTK, Quest)",
    container=VALUE,
    recognises=_recognises,
    read=_read,
)
