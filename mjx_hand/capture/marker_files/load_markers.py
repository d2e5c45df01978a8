"""`load_markers`: a marker recording from a file of any format that the project reads."""

from pathlib import Path

from mjx_hand.capture.marker_files.marker_format import marker_formats
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.files.input_file import refuse_pointer


def load_markers(path: str | Path, units: str | None = None) -> MarkerRecording:
    """Read labelled markers, in metres; the format is told by the suffix (`mjx_hand/capture/marker_files`).

    Args:
        path: of the recording.
        units: m, cm, mm or in: read the numbers in this unit, whatever the file says. None believes the file.

    Raises:
        InputError: there is no such file, no format has its suffix, or its contents are not sound.
    """
    path = Path(path)
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {found}; give the path of a marker recording")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: the file is empty; export the recording again")
    refuse_pointer(path)
    formats = marker_formats()
    for known in formats:
        if path.suffix.lower() in known.suffixes:
            return known.read(path, units)
    raise InputError(
        f"{path}: suffix {path.suffix or 'none'} is not a marker file's; read are {', '.join(f.name for f in formats)}"
    )
