"""Read the pickles of the MANO family without running anything that they name.

A pickle is a program: it may import and call whatever it likes. Here every name that it asks for is looked up in a
short list, and each name of the list becomes an inert record of what it was called with: no class or function of
NumPy, SciPy, chumpy or Python itself is imported or called. `array` then turns records into NumPy arrays by reading
their bytes.
"""

import io
import pickle
import re
import struct
import sys
from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import numpy as np

from mjx_hand.errors import InputError

# Python 2 and NumPy 1 names of modules that have moved.
_MOVED = {
    "__builtin__": "builtins",
    "copy_reg": "copyreg",
    "numpy.core.multiarray": "numpy._core.multiarray",
    "numpy.core.numeric": "numpy._core.numeric",
    "numpy.matrixlib.defmatrix": "numpy",
    **{f"scipy.sparse.{kind}": f"scipy.sparse._{kind}" for kind in ("csc", "csr", "coo")},
}
_KNOWN = {
    "_codecs.encode",  # how Python 3 writes bytes in protocols 0 to 2
    "builtins.object",
    "builtins.set",
    "chumpy.ch.Ch",
    "chumpy.reordering.Select",
    "copyreg._reconstructor",
    "numpy._core.multiarray._reconstruct",
    "numpy._core.multiarray.scalar",
    "numpy._core.numeric._frombuffer",
    "numpy.dtype",
    "numpy.matrix",
    "numpy.ndarray",
    *(f"scipy.sparse._{kind}.{kind}_{form}" for kind in ("csc", "csr", "coo") for form in ("matrix", "array")),
    # PyTorch's tensors, which `safe_tensor` reads
    "collections.OrderedDict",
    "torch._utils._rebuild_tensor_v2",
    "torch.storage._load_from_bytes",
    *(f"torch.{kind}Storage" for kind in ("Half", "Float", "Double", "Int", "Long", "Short", "Char", "Byte", "Bool")),
}
_LARGEST = 10**7  # entries of a sparse matrix made dense; MANO's have 12,448


class Record:
    """What a name was called with (`args`) and then given as its state."""

    name = ""

    def __new__(cls, *args: Any, **_: Any) -> "Record":
        record = object.__new__(cls)
        record.args = args
        record.state = None
        return record

    def __init__(self, *_: Any, **__: Any):
        self.args: tuple[Any, ...]
        self.state: Any

    def __setstate__(self, state: Any) -> None:
        self.state = state


class _Forbidden(Exception):
    """A name outside the list."""


def _check_keys(keys: Iterable[Any]) -> None:
    """Nothing, if keys are what data have for keys: Python would follow deeper ones to the end of its stack."""
    for key in keys:
        for part in key if isinstance(key, tuple) else (key,):
            if not isinstance(part, str | bytes | int | float | complex | Record | None):
                raise pickle.UnpicklingError("a key or an entry of a set that is no name and no number")


def _with_keys_checked(opcode: bytes, keys: slice) -> Callable[[Any], None]:
    """What an opcode does, once `_check_keys` has seen that part of the stack."""
    load = pickle._Unpickler.dispatch[opcode[0]]

    def checked(reader: Any) -> None:
        _check_keys(reader.stack[keys])
        load(reader)

    return checked


def _load_bytearray(reader: Any) -> None:
    """BYTEARRAY8 without room for more bytes than there are."""
    (length,) = struct.unpack("<Q", reader.read(8))
    data = reader.read(min(length, sys.maxsize))
    if len(data) < length:
        raise pickle.UnpicklingError("truncated")
    reader.append(bytearray(data))


# The pure-Python unpickler: the C one reserves memory for whatever memo index a damaged file names.
class Reader(pickle._Unpickler):
    """An unpickler whose names are records."""

    dispatch: ClassVar[dict[int, Callable[[Any], None]]] = pickle._Unpickler.dispatch | {
        pickle.BYTEARRAY8[0]: _load_bytearray,
        pickle.SETITEM[0]: _with_keys_checked(pickle.SETITEM, slice(-2, -1)),
        pickle.SETITEMS[0]: _with_keys_checked(pickle.SETITEMS, slice(None, None, 2)),
        pickle.DICT[0]: _with_keys_checked(pickle.DICT, slice(None, None, 2)),
        pickle.ADDITEMS[0]: _with_keys_checked(pickle.ADDITEMS, slice(None)),
        pickle.FROZENSET[0]: _with_keys_checked(pickle.FROZENSET, slice(None)),
    }

    def find_class(self, module: str, name: str) -> type[Record]:
        full = f"{_MOVED.get(module, module)}.{name}"
        if full not in _KNOWN:
            raise _Forbidden(f"{module}.{name}")
        return type(name, (Record,), {"name": full})  # a new class each time, so that no file can alter the next one's

    def persistent_load(self, pid: Any) -> Any:
        raise _Forbidden("an external object (persistent id)")


def unpickle(data: bytes, where: str, whose: str, source: str) -> Any:
    """What a pickle holds, its objects left as records for `array`.

    Args:
        data: the file's bytes.
        where: the file's name, for messages.
        whose: what the file should be, for messages: "hand model".
        source: where to get a sound one, for messages.

    Raises:
        InputError: the pickle names something outside the list, or is damaged.
    """
    try:
        return Reader(io.BytesIO(data), encoding="latin1").load()
    except _Forbidden as error:
        raise InputError(
            f"{where}: refused, since it names {str(error)!r}, which no {whose} needs and which could run code; "
            f"nothing was run; get the file from {source}"
        ) from None
    except Exception as error:  # damaged bytes raise anything at all
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{where}: not a readable pickle ({reason}); it may be truncated, copy it again") from None


def read(data: bytes, where: str) -> dict[str, Any]:
    """The dictionary that a hand model's pickle holds, its objects left as records for `array`.

    Args:
        data: the file's bytes.
        where: the file's name, for messages.

    Raises:
        InputError: the pickle names something outside the list, is damaged, or holds no dictionary.
    """
    loaded = unpickle(data, where, "hand model", "https://mano.is.tue.mpg.de")
    if not isinstance(loaded, dict):
        raise InputError(f"{where}: holds a {type(loaded).__name__}, expected a MANO file's dictionary of arrays")
    return loaded


def array(value: Any) -> np.ndarray:
    """The NumPy array that a value of `read`'s dictionary stands for.

    Understands NumPy arrays, matrices and scalars of plain numbers, SciPy's csc, csr and coo matrices (made dense),
    and chumpy's `Ch` and `Select`.

    Raises:
        ValueError: it stands for none of these, or contradicts itself.
    """
    if isinstance(value, np.ndarray | int | float):
        return np.asarray(value)
    if not isinstance(value, Record):
        raise ValueError(f"a {type(value).__name__}, not an array")
    match value.name.rsplit(".", 1)[-1]:
        case "_reconstruct":
            shape, dtype, fortran, data = value.state[-4:]
            return _from_bytes(data, dtype, shape, "F" if fortran else "C")
        case "_frombuffer":
            data, dtype, shape, order = value.args
            return _from_bytes(data, dtype, shape, order)
        case "scalar":
            dtype, data = value.args
            return _from_bytes(data, dtype, (), "C")
        case "Ch":
            return array(value.state["x"])
        case "Select":
            chosen = array(value.state["a"]).ravel()[array(value.state["idxs"]).astype(np.int64).ravel()]
            return chosen.reshape(_shape(value.state.get("preferred_shape", chosen.shape)))
        case "csc_matrix" | "csc_array":
            return _dense(value.state, by_column=True)
        case "csr_matrix" | "csr_array":
            return _dense(value.state, by_column=False)
        case "coo_matrix" | "coo_array":
            return _dense_of_entries(value.state)
        case "_reconstructor":  # protocols 0 and 1: what is made is the first argument
            made = value.args[0]()
            made.state = value.state
            return array(made)
        case other:
            raise ValueError(f"a {other}, not an array")


def bytes_of(data: Any) -> bytes:
    """The bytes that a value stands for, however its protocol writes them.

    Raises:
        ValueError: it stands for something else.
    """
    if isinstance(data, bytes | bytearray):
        return bytes(data)
    if isinstance(data, str):  # a Python 2 string
        return data.encode("latin1")
    if isinstance(data, Record) and data.name == "_codecs.encode":
        text, codec = data.args
        if codec == "latin1" and isinstance(text, str):
            return text.encode("latin1")
    raise ValueError("an array of objects, not of numbers")


def _from_bytes(data: Any, dtype: Any, shape: Any, order: str) -> np.ndarray:
    if not isinstance(dtype, Record) or dtype.name != "numpy.dtype":
        raise ValueError("an array without a number type")
    code = dtype.args[0]
    byte_order, *structure = dtype.state[1:5] if dtype.state else ("=",)
    if not re.fullmatch("[fiu][1248]|b1", code) or any(part is not None for part in structure):
        raise ValueError(f"an array of type {code!r}, not of plain numbers")
    native = np.frombuffer(bytes_of(data), np.dtype(code).newbyteorder(byte_order)).astype(code)
    return native.reshape(_shape(shape), order="F" if order == "F" else "C")


def _shape(shape: Any) -> tuple[int, ...]:
    return tuple(int(n) for n in (array(shape) if isinstance(shape, Record) else shape))


def _dense(state: dict[str, Any], by_column: bool) -> np.ndarray:
    """A compressed sparse matrix, dense; every index is checked by NumPy."""
    rows, columns = _shape(state.get("_shape", state.get("shape")))
    data, indices, starts = (array(state[key]).ravel() for key in ("data", "indices", "indptr"))
    outer, inner = (columns, rows) if by_column else (rows, columns)
    counts = np.diff(starts.astype(np.int64))
    fits = len(starts) == outer + 1 and starts[0] == 0 and starts[-1] == len(data)
    if not fits or (counts < 0).any() or rows * columns > _LARGEST:
        raise ValueError(f"a sparse matrix of {rows} x {columns} whose parts do not fit together")
    dense = _filled(outer, inner, np.repeat(np.arange(outer), counts), indices, data)
    return dense.T if by_column else dense


def _dense_of_entries(state: dict[str, Any]) -> np.ndarray:
    """A sparse matrix that lists its entries' places, dense."""
    rows, columns = _shape(state.get("_shape", state.get("shape")))
    at = state["coords"] if "coords" in state else (state["row"], state["col"])
    first, second, data = (array(value).ravel() for value in (*at, state["data"]))
    return _filled(rows, columns, first, second, data)


def _filled(rows: int, columns: int, first: np.ndarray, second: np.ndarray, data: np.ndarray) -> np.ndarray:
    """A matrix with these entries; those of one place add up."""
    if min(rows, columns) < 0 or rows * columns > _LARGEST or not len(first) == len(second) == len(data):
        raise ValueError(f"a sparse matrix of {rows} x {columns} whose parts do not fit together")
    for index, end in ((first, rows), (second, columns)):
        if index.size and (index.dtype.kind not in "iu" or not 0 <= index.min() <= index.max() < end):
            raise ValueError(f"a sparse matrix of {rows} x {columns} with indices outside it")
    dense = np.zeros((rows, columns), data.dtype)
    np.add.at(dense, (first, second), data)
    return dense
