"""Reading an `.npz` whoever made it: only what is asked for, never more than the file can hold, and nothing is run.

An archive says of each member how long it is, and each member's header what array it is; both are compared before
anything is unpacked. A file of zeros unpacks to a thousand times its size, which no recording does: all that is read of
one file stays below `_ROOM` bytes and `_RATIO` times the file's size.
"""

import math
import warnings
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Union

import numpy as np

from mjx_hand.errors import InputError, reason_of

_ROOM, _RATIO = 64 * 2**20, 20
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # the two that NumPy writes
_ENCRYPTED = 0x1
_CODE_POINTS = 0x10FFFF
_MOST_LETTERS = 60  # of a member's name in a message

Arrays = Union["Archive", Mapping[str, np.ndarray]]  # what loaders take: of a file, or made otherwise


class Archive(Mapping[str, Any]):
    """The arrays of an `.npz` file by name, each read when it is asked for first.

    Args:
        path: of the file.
        objects: what to make of a member that is a pickle, from its bytes and what to call it; such are refused if
            None.

    Raises:
        InputError: it is not a readable archive, by the constructor; a member is damaged, needs pickle or is larger
            than the file can hold, by looking it up.
    """

    def __init__(self, path: Path, objects: Callable[[bytes, str], Any] | None = None):
        self._path, self._objects = path, objects
        self._found: dict[str, Any] = {}
        try:
            self._zip = zipfile.ZipFile(path)
            self._room = _ROOM + _RATIO * path.stat().st_size
        except Exception as error:  # damaged bytes raise anything at all
            raise InputError(f"{path}: not a readable .npz file ({reason_of(error)}); copy it again") from None
        members = [member for member in self._zip.infolist() if member.filename.endswith(".npy")]
        self._members = {member.filename.removesuffix(".npy"): member for member in members}
        if len(self._members) < len(members):
            raise InputError(f"{path}: not a readable .npz file (two arrays of one name); write it again")

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)

    def __contains__(self, name: object) -> bool:
        return name in self._members

    def __getitem__(self, name: str) -> Any:
        if name not in self._found:
            member = self._members[name]
            try:
                self._found[name] = self._read(member)
            except InputError:
                raise
            except Exception as error:
                raise InputError(
                    f"{self._path}: {_short(name)}: not a readable .npy array ({reason_of(error)}); copy it again"
                ) from None
        return self._found[name]

    def hide(self, name: str) -> None:
        """Hold no array of that name from now on."""
        self._members.pop(name, None)

    def _read(self, member: zipfile.ZipInfo) -> Any:
        if member.compress_type not in _METHODS or member.flag_bits & _ENCRYPTED:
            raise ValueError("packed in a way that NumPy does not use")
        self._take(member.file_size)
        with self._zip.open(member) as stream:
            shape, dtype = _header(stream)
            if dtype.hasobject:
                if self._objects is None:
                    raise ValueError("Python objects, not numbers")
                return self._objects(stream.read(), f"{self._path}: {_short(member.filename[:-4])}")
            room = math.prod(max(n, 1) for n in shape) * max(dtype.itemsize, 1)
            if min(shape, default=0) < 0 or room > self._room + member.file_size:
                raise ValueError(f"an array of shape {shape}, larger than the file can hold")
            if stream.tell() + math.prod(shape) * dtype.itemsize != member.file_size:
                raise ValueError(f"{member.file_size} bytes are not an array of shape {shape}")
        with self._zip.open(member) as stream, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of headers that Python 2 wrote
            value = np.lib.format.read_array(stream, allow_pickle=False)
            stream.read()  # to its end, where its checksum is compared
        if dtype.kind == "U" and dtype.itemsize and value.size:
            letters = np.frombuffer(value.tobytes(), np.dtype(np.uint32).newbyteorder(dtype.byteorder))
            if letters.max() > _CODE_POINTS:
                raise ValueError("text that is not Unicode")
        return value

    def _take(self, size: int) -> None:
        self._room -= size
        if self._room < 0:
            raise ValueError("it would unpack to far more than the file's size")


def _header(stream: Any) -> tuple[tuple[int, ...], np.dtype]:
    version = np.lib.format.read_magic(stream)
    read = np.lib.format.read_array_header_1_0 if version < (2, 0) else np.lib.format.read_array_header_2_0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        shape, _, dtype = read(stream)
    return shape, dtype


def _short(name: str) -> str:
    return name if len(name) <= _MOST_LETTERS else f"{name[:_MOST_LETTERS]}…"
