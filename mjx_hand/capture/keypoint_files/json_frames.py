"""Keypoints as JSON: a list of frames, an object with `frames` and, beside it, `fps`, `unit`, `side` and `layout`, or
one frame alone.

`json_hands` has the forms that a frame may have, `frame_lists` where the frames stand. A frame's `time`, `timestamp` or
`t` gives the rate where `fps` is not said; a frame that is null or empty is a gap.
"""

from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.reader import VALUE, KeypointReader
from mjx_hand.capture.keypoint_frames.assemble import Clock, recordings
from mjx_hand.capture.keypoint_frames.frame_lists import frames_in
from mjx_hand.capture.keypoint_frames.json_hands import frame_hands, has_world_landmarks
from mjx_hand.capture.keypoint_frames.json_points import is_number
from mjx_hand.capture.keypoint_frames.leap_frames import is_leap_frame
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.times import stated_rate
from mjx_hand.errors import InputError

_TIMES = ("time", "timestamp", "t", "timestamp_ms", "time_ms")
_RATES = ("fps", "frame_rate", "frameRate", "rate")


def _recognises(value: Any) -> bool:
    frames, _ = frames_in(value)
    return any(is_leap_frame(frame) or has_world_landmarks(frame) or frame_hands(frame) for frame in frames)


def _read(path: Path, value: Any, unit: str | None) -> dict[str, KeypointRecording]:
    frames, said = frames_in(value)
    return recordings(path, [frame_hands(frame) for frame in frames], _clock(path, said, frames), said, unit)


def _clock(path: Path, said: dict[str, Any], frames: list[Any]) -> Clock:
    times = [next((frame[key] for key in _TIMES if key in frame), None) for frame in frames if isinstance(frame, dict)]
    rate = next((stated_rate(path, key, said[key]) for key in _RATES if said.get(key) is not None), None)
    separate = any(isinstance(frame, dict) and "handyRevision" in frame for frame in frames)  # postures, no motion
    if rate is not None or separate or len(times) < len(frames) or None in times:
        return Clock(rate=rate)
    if not all(is_number(each) for each in times):
        raise InputError(f"{path}: a frame's time is {str(times[0])[:40]!r}, expected a number of seconds")
    return Clock(times=np.array(times, float))


READER = KeypointReader(
    name="keypoint frames (MediaPipe, Leap, WebXR, OpenXR, ARKit, MRTK, Quest)",
    container=VALUE,
    recognises=_recognises,
    read=_read,
)
