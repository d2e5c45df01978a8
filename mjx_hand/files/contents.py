"""What a file holds: named values, or a list of them, read without running anything that the file names.

Datasets ship pickles, and `.npy` and `.npz` files with pickles inside. All of them go through `files.safe_pickle`;
what is not an array of numbers stays a record until `plain` is asked for it.
"""

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.errors import InputError, reason_of
from mjx_hand.files import safe_pickle
from mjx_hand.files.input_file import refuse_pointer
from mjx_hand.files.npz_reader import Archive
from mjx_hand.files.safe_tensor import is_tensor, tensor

PICKLES = (".pkl", ".pickle", ".p")
WHOLE = ""  # the name of a value that is not a dictionary of named ones


def read_contents(path: Path) -> Mapping[Any, Any]:
    """The named values in an `.npz`, or of the dictionary in an `.npy` or pickle; any other single value as `WHOLE`.

    Those of an `.npz` are read when they are looked up.

    Nothing for other kinds of file, and for folders.

    Raises:
        InputError: the file is damaged, or names what no recording needs.
    """
    if not path.is_file():
        return {}
    refuse_pointer(path)
    suffix = path.suffix.lower()
    if suffix == ".npz" or (suffix not in (*PICKLES, ".npy") and zipfile.is_zipfile(path)):
        return read_archive(path)
    if suffix == ".npy":
        value = _array(path.read_bytes(), str(path))
    elif suffix in PICKLES:
        value = _unpickled(path.read_bytes(), str(path))
    else:
        return {}
    value = unwrapped(value)
    return value if isinstance(value, dict) else {WHOLE: value}


def unwrapped(value: Any) -> Any:
    """What NumPy wrapped as an array of objects: the object of a lone one, else the list of them."""
    if not isinstance(value, safe_pickle.Record) or not value.name.endswith("._reconstruct"):
        return value
    match value.state:
        case (_, tuple() as shape, safe_pickle.Record(args=(str() as code, *_)), _, list() as data):
            if code.startswith("O"):
                return data[0] if shape == () and len(data) == 1 else data
    return value


def plain(path: str | Path, name: str, value: Any) -> np.ndarray:
    """The array that a value of `read_contents` stands for, whether NumPy's, PyTorch's or a list of numbers.

    Args:
        path: for the message.
        name: what the message calls it.
        value: what was found there.

    Raises:
        InputError: it stands for none.
    """
    try:
        found = unwrapped(value)
        if is_tensor(found):
            return tensor(found)
        if isinstance(found, list | tuple):
            return np.stack([plain(path, name, item) for item in found]) if found else np.zeros(0)
        return safe_pickle.array(found)
    except InputError:
        raise
    except Exception as error:  # a damaged value raises anything at all
        raise InputError(
            f"{path}: cannot read {name!r} ({reason_of(error)}); get the file again from its publisher"
        ) from None


def _unpickled(data: bytes, where: str) -> Any:
    return safe_pickle.unpickle(data, where, "recording", "its publisher")


def read_archive(path: Path) -> Mapping[str, Any]:
    """The named values in an `.npz`, whatever it is called; its objects, if it has any, as records.

    Raises:
        InputError: not a readable archive, or a value that is looked up is damaged or names what no recording needs.
    """
    return Archive(path, lambda data, where: unwrapped(_unpickled(data, where)))


def _array(data: bytes, where: str) -> Any:
    """The array in an `.npy` file, or the records of its pickle."""
    stream = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        read_header = np.lib.format.read_array_header_1_0 if version < (2, 0) else np.lib.format.read_array_header_2_0
        _, _, dtype = read_header(stream)
        if not dtype.hasobject:
            stream.seek(0)
            return np.lib.format.read_array(stream, allow_pickle=False)
    except Exception as error:  # damaged bytes raise anything at all
        raise InputError(f"{where}: not a readable .npy array ({reason_of(error)}); copy it again") from None
    return _unpickled(stream.read(), where)
