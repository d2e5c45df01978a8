"""The project's own motion files."""

from pathlib import Path

from mjx_hand.capture.datasets.dataset_format import Arrays, DatasetFormat
from mjx_hand.motion import Motion, load_motion_file
from mjx_hand.motion.motion import SCHEMA


def _recognises(path: Path, arrays: Arrays) -> bool:
    return str(arrays.get("schema", "")) == SCHEMA


def _read(path: Path, arrays: Arrays) -> Motion:
    return load_motion_file(path)


FORMAT = DatasetFormat(name=f"mjx-hand motion (.npz, schema {SCHEMA})", recognises=_recognises, read=_read)
