"""Which recordings a path stands for: one, or all below a folder; and a digest of what they hold."""

from pathlib import Path

from mjx_hand.capture.load_scene import scene_format
from mjx_hand.errors import InputError
from mjx_hand.files.contents import read_contents
from mjx_hand.files.digests import digest, file_piece

_BESIDE = (".stl", ".obj", ".ply", ".glb", ".off")  # meshes that a recording's file does not hold itself


def recordings_of(path: str | Path) -> list[Path]:
    """The recordings with objects at a path: itself, or those below a folder, in the order of their names.

    Raises:
        InputError: there is nothing there, or no recording with objects.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(
            f"{path}: no such file or folder; give a recording with its objects, or a folder of such: "
            "data.recording.path=PATH"
        )
    found = [path] if path.is_file() else _below(path)  # what a single file is, its reader says
    if not found:
        raise InputError(
            f"{path}: no recording with objects is there; valid are a scene's file (mjx-hand scene), or a data set's "
            "recording with its objects: data.recording.path=PATH"
        )
    return found


def recording_digest(path: str | Path) -> str:
    """A digest of all that the recordings at a path are made of, wherever they are.

    Raises:
        InputError: as `recordings_of`.
    """
    pieces: list[bytes] = []
    for recording in recordings_of(path):
        pieces += [recording.name.encode(), *map(file_piece, _files(recording))]
    return digest(pieces)


def _below(path: Path) -> list[Path]:
    if _is_scene(path):
        return [path]
    if path.is_file():
        return []
    inside = sorted(p for p in path.iterdir() if not p.name.startswith("."))
    return [found for each in inside if each.is_dir() or each.suffix.lower() not in _BESIDE for found in _below(each)]


def _is_scene(path: Path) -> bool:
    try:
        return scene_format(path, read_contents(path)) is not None
    except InputError:
        return False


def _files(recording: Path) -> list[Path]:
    if recording.is_dir():
        return sorted(file for file in recording.rglob("*") if file.is_file())
    beside = [file for file in recording.absolute().parent.iterdir() if file.suffix.lower() in _BESIDE]
    return [recording, *sorted(beside)]
