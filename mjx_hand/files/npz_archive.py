"""Reading and writing the documented `.npz` form of the data that crosses walls.

Every file holds named arrays, a `schema` string ("name/version") and nothing that needs pickle. Files are written
under a temporary name and renamed, so that a reader never sees half of one.
"""

import contextlib
import os
import re
import tempfile
import zipfile
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import numpy as np

from mjx_hand.errors import InputError, reason_of
from mjx_hand.files.input_file import refuse_pointer
from mjx_hand.files.npz_reader import Archive

_MAGIC = b"\x93NUMPY"
_TEMPORARY = re.compile(r"\.(?P<stem>.+)-[a-z0-9_]{8}(?P<suffix>\.[^.]*|)")  # as `replacing` names them


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; on success it takes `path`'s place, on failure it goes.

    The contents are on the disk before the name is: after a loss of power the file is the old one or the new one.

    Raises:
        InputError: the file cannot be written there.
    """
    path = followed(Path(path))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix)
    except (OSError, ValueError) as error:
        raise _cannot_write(path, error) from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)  # mkstemp makes private files; give it the mode that open() would
        with temporary.open("r+b") as written:
            os.fsync(written.fileno())
        temporary.replace(path)
        _flush_folder(path.parent)
    except OSError as error:  # a full disk, or `path` is a folder
        raise _cannot_write(path, error) from None
    finally:
        temporary.unlink(missing_ok=True)


def followed(path: Path) -> Path:
    """What a symbolic link leads to, so that the link stays; `path` itself if it is none."""
    target = Path(os.path.realpath(path)) if path.is_symlink() else path
    if target.is_symlink():
        raise InputError(f"cannot write {path}: its symbolic links lead round in a circle; choose another place")
    return target


def remove_leftovers(folder: Path, names: Collection[str] | None = None) -> None:
    """Delete what processes that were killed left of `replacing` files of a folder; nobody may be writing them now.

    Args:
        folder: of the files.
        names: theirs; all if None.
    """
    for path in folder.glob(".*"):
        match = _TEMPORARY.fullmatch(path.name)
        if match and (names is None or f"{match['stem']}{match['suffix']}" in names):
            path.unlink(missing_ok=True)


def _flush_folder(folder: Path) -> None:
    """Put a new name on the disk, where the system lets a folder be opened."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _cannot_write(path: Path, error: Exception) -> InputError:
    reason = getattr(error, "strerror", None) or reason_of(error)
    return InputError(f"cannot write {path}: {reason}; choose a place that you may write to")


def save_arrays(path: str | Path, schema: str, arrays: Mapping[str, np.ndarray | int | float | str]) -> None:
    """Write named arrays as a compressed `.npz` with its schema."""
    with replacing(path) as temporary, temporary.open("wb") as file:
        stored = {name: np.asarray(value) for name, value in arrays.items()}
        np.savez_compressed(file, allow_pickle=False, schema=np.array(schema), **stored)


def open_arrays(path: str | Path) -> dict[str, np.ndarray]:
    """All arrays of an `.npz` file, without pickle.

    Raises:
        InputError: the file is missing, is not an `.npz`, is damaged, is larger unpacked than it can be, or would need
            pickle.
    """
    return dict(open_archive(path))


def open_archive(path: str | Path) -> Archive:
    """The arrays of an `.npz` file, without pickle, each read when it is looked up.

    Raises:
        InputError: the file is missing, is not an `.npz` or is damaged; looked up, an array that is damaged, is larger
            than the file can hold or would need pickle.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file; give the path of an .npz file")
    refuse_pointer(path)
    if not zipfile.is_zipfile(path):
        lone = "a single array, not an .npz archive of named arrays" if _is_array(path) else "not a readable .npz file"
        raise InputError(f"{path}: {lone}; give an .npz file, or copy it again")
    return Archive(path)


def schema_of(path: str | Path) -> str:
    """The schema of a file that `save_arrays` wrote; empty for any other file."""
    path = Path(path)
    try:
        if not (path.is_file() and zipfile.is_zipfile(path)):
            return ""
        return _schema(Archive(path))
    except (InputError, OSError, ValueError):
        return ""


def load_arrays(path: str | Path, schema: str) -> Archive:
    """Arrays of a file that `save_arrays` wrote with this schema, each read when it is looked up.

    Raises:
        InputError: not such a file, or of another schema or version; looked up, as `open_archive`.
    """
    arrays = open_archive(path)
    found = _schema(arrays)
    if found != schema:
        raise InputError(
            f"{path}: schema {found or 'none'}, expected {schema}; make it again with this version of mjx-hand"
        )
    arrays.hide("schema")
    return arrays


def _schema(arrays: Archive) -> str:
    value = arrays.get("schema", np.array(0))
    return value.item() if value.ndim == 0 and value.dtype.kind == "U" else ""


def _is_array(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(_MAGIC)) == _MAGIC
