"""`load_markers`: a marker recording from a file of any format that the project reads."""

from pathlib import Path

from mjx_hand.capture.marker_files.marker_format import MarkerFormat, marker_formats
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.files.input_file import refuse_pointer


def load_markers(path: str | Path, units: str | None = None, fps: float | None = None) -> MarkerRecording:
    """Read labelled markers, in metres.

    The format is told by the suffix and, among tables, the first line (`mjx_hand/capture/marker_files`).

    Args:
        path: of the recording.
        units: m, cm, mm or in: read the numbers in this unit, whatever the file says. None believes the file.
        fps: frames per second, where the file does not say.

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
    known = marker_format_of(path)
    if known is None:
        names = ", ".join(each.name for each in marker_formats())
        raise InputError(f"{path}: suffix {path.suffix or 'none'} is not a marker file's; read are {names}")
    return known.read(path, units, fps)


def marker_format_of(path: Path) -> MarkerFormat | None:
    """The format of a file by its suffix and, where several share it, by how it begins; None if it is none of them."""
    of_suffix = [known for known in marker_formats() if path.suffix.lower() in known.suffixes]
    marked_first = sorted(of_suffix, key=lambda known: not known.begins)
    return next((known for known in marked_first if _begins_with(path, known.begins)), None)


def _begins_with(path: Path, text: str) -> bool:
    """Whether a file begins with this text, a mark of its encoding apart."""
    with path.open("rb") as file:
        start = file.read(len(text) + 3).removeprefix(b"\xef\xbb\xbf")
    return start.startswith(text.encode())
