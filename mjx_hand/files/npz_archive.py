"""Reading and writing the documented `.npz` form of the data that crosses walls.

Every file holds named arrays, a `schema` string ("name/version") and nothing that needs pickle. Files are written
under a temporary name and renamed, so that a reader never sees half of one.
"""

import contextlib
import os
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.files.input_file import refuse_pointer


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; on success it takes `path`'s place, on failure it goes.

    Raises:
        InputError: the file cannot be written there.
    """
    path = followed(Path(path))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix)
    except OSError as error:
        raise _cannot_write(path, error) from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)  # mkstemp makes private files; give it the mode that open() would
        temporary.replace(path)
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


def _cannot_write(path: Path, error: OSError) -> InputError:
    return InputError(f"cannot write {path}: {error.strerror or error}; choose a place that you may write to")


def save_arrays(path: str | Path, schema: str, arrays: Mapping[str, np.ndarray | int | float | str]) -> None:
    """Write named arrays as a compressed `.npz` with its schema."""
    with replacing(path) as temporary, temporary.open("wb") as file:
        stored = {name: np.asarray(value) for name, value in arrays.items()}
        np.savez_compressed(file, allow_pickle=False, schema=np.array(schema), **stored)


def open_arrays(path: str | Path) -> dict[str, np.ndarray]:
    """All arrays of an `.npz` file, without pickle.

    Raises:
        InputError: the file is missing, is not an `.npz`, is damaged or would need pickle.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file; give the path of an .npz file")
    refuse_pointer(path)
    try:
        # The file is opened here: np.load leaves one open that it opened itself and then cannot read.
        with path.open("rb") as opened:
            file = np.load(opened, allow_pickle=False)
            if not isinstance(file, np.lib.npyio.NpzFile):
                raise InputError(f"{path}: a single array, not an .npz archive of named arrays")
            with file:
                return {name: file[name] for name in file.files}
    except InputError:
        raise
    except (ValueError, OSError, EOFError, zipfile.BadZipFile, zlib.error, KeyError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{path}: not a readable .npz file ({reason})") from None


def schema_of(path: str | Path) -> str:
    """The schema of a file that `save_arrays` wrote; empty for any other file."""
    path = Path(path)
    if not (path.is_file() and zipfile.is_zipfile(path)):
        return ""
    try:
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            return str(file["schema"]) if "schema" in file.files else ""
    except (ValueError, OSError, EOFError, zipfile.BadZipFile, zlib.error, KeyError):
        return ""


def load_arrays(path: str | Path, schema: str) -> dict[str, np.ndarray]:
    """Arrays of a file that `save_arrays` wrote with this schema.

    Raises:
        InputError: not such a file, or of another schema or version.
    """
    arrays = open_arrays(path)
    found = str(arrays.pop("schema", "none"))
    if found != schema:
        raise InputError(f"{path}: schema {found}, expected {schema}; make it again with this version of mjx-hand")
    return arrays
