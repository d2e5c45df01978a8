"""The project's own marker files."""

from pathlib import Path

from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.markers.marker_recording import SCHEMA, MarkerRecording, load_recording_file
from mjx_hand.errors import InputError


def _read(path: Path, units: str | None, fps: float | None) -> MarkerRecording:
    if units is not None:
        raise InputError(f"{path}: the project's own marker files are in metres; leave --units out")
    recording = load_recording_file(path)
    if fps not in (None, recording.fps):
        raise InputError(f"{path}: was recorded at {recording.fps:g} frames per second; leave out fps={fps:g}")
    return recording


FORMAT = MarkerFormat(name=f"mjx-hand markers (.npz, schema {SCHEMA})", suffixes=(".npz",), read=_read)
