"""The project's own motion files."""

from pathlib import Path

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.motion import Motion, load_motion_file
from mjx_hand.motion.motion import SCHEMA


def _recognises(path: Path, arrays: Contents) -> bool:
    return str(arrays.get("schema", "")) == SCHEMA


def _read(path: Path, arrays: Contents, request: Request) -> Motion:
    return load_motion_file(path)


FORMAT = DatasetFormat(name=f"mjx-hand motion (.npz, schema {SCHEMA})", recognises=_recognises, read=_read)
