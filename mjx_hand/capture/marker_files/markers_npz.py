"""The project's own marker files."""

from pathlib import Path

from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.markers.marker_recording import SCHEMA, MarkerRecording, load_recording_file
from mjx_hand.errors import InputError


def _read(path: Path, units: str | None) -> MarkerRecording:
    if units is not None:
        raise InputError(f"{path}: the project's own marker files are in metres; leave --units out")
    return load_recording_file(path)


FORMAT = MarkerFormat(name=f"mjx-hand markers (.npz, schema {SCHEMA})", suffixes=(".npz",), read=_read)
