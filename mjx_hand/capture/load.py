"""`load_motion`: a hand motion from a file of any format that the project reads."""

import zipfile
from pathlib import Path

from mjx_hand.capture.datasets.dataset_format import dataset_formats
from mjx_hand.errors import InputError
from mjx_hand.motion import Motion
from mjx_hand.motion.archive import open_arrays

_SHOWN = 6  # how many names of an unknown archive the message lists
_MARKER_FILES = (".c3d", ".trc", ".tsv")


def load_motion(path: str | Path) -> Motion:
    """Read a motion; the format is recognised from the file itself (`mjx_hand/capture/datasets`, one module each).

    Raises:
        InputError: there is no such file, no format recognises it, or its contents are not sound.
    """
    path = Path(path)
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {found}; give the path of a recording")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: the file is empty; give the path of a recording")
    archive = path.suffix == ".npz" or zipfile.is_zipfile(path)
    arrays = open_arrays(path) if archive else {}
    formats = dataset_formats()
    for known in formats:
        if known.recognises(path, arrays):
            return known.read(path, arrays)
    raise InputError(f"{path}: {_found(path, arrays)}; formats read: {', '.join(known.name for known in formats)}")


def _found(path: Path, arrays: dict) -> str:
    if path.suffix.lower() in _MARKER_FILES:
        return "a marker recording, which needs a fit first"
    if "schema" in arrays:
        return f"an .npz of schema {arrays['schema']}, not a motion"
    if arrays:
        names = list(arrays)
        return f"an .npz of {', '.join(names[:_SHOWN])}{' and more' if len(names) > _SHOWN else ''}"
    return f"not a recording that is known here (suffix {path.suffix or 'none'})"
