"""The project's own keypoint files."""

from pathlib import Path
from typing import Any

from mjx_hand.capture.keypoint_files.reader import ARRAYS, KeypointReader
from mjx_hand.capture.keypoints.recording import SCHEMA, KeypointRecording, load_keypoint_file
from mjx_hand.errors import InputError


def _recognises(arrays: Any) -> bool:
    return str(arrays.get("schema", "")) == SCHEMA


def _read(path: Path, arrays: Any, unit: str | None) -> dict[str, KeypointRecording]:
    if unit not in (None, "m"):
        raise InputError(f"{path}: is in metres; leave out unit={unit!r}")
    recording = load_keypoint_file(path)
    return {recording.side or "hand": recording}


READER = KeypointReader(
    name=f"mjx-hand keypoints (schema {SCHEMA})", container=ARRAYS, recognises=_recognises, read=_read
)
