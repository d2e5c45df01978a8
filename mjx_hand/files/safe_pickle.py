"""Read the pickles of the MANO family without running anything that they name.

A pickle is a program: it may import and call whatever it likes. Here every name that it asks for is looked up in a
short list, and each name of the list becomes an inert record of what it was called with: no class or function of
NumPy, SciPy, chumpy or Python itself is imported or called. `array` then turns records into NumPy arrays by reading
their bytes.
"""

import io
import pickle
import re
from typing import Any

import numpy as np

from mjx_hand.errors import InputError

# Python 2 and NumPy 1 names of modules that have moved.
_MOVED = {
    "__builtin__": "builtins",
    "copy_reg": "copyreg",
    "numpy.core.multiarray": "numpy._core.multiarray",
    "numpy.core.numeric": "numpy._core.numeric",
    "numpy.matrixlib.defmatrix": "numpy",
    **{f"scipy.sparse.{kind}": f"scipy.sparse._{kind}" for kind in ("csc", "csr")},
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
    *(f"scipy.sparse._{kind}.{kind}_{form}" for kind in ("csc", "csr") for form in ("matrix", "array")),
    # PyTorch's tensors, which `safe_tensor` reads
    "collections.OrderedDict",
    "torch._utils._rebuild_tensor_v2",
    "torch.storage._load_from_bytes",
    *(f"torch.{kind}Storage" for kind in ("Half", "Float", "Double", "Int", "Long", "Short", "Char", "Byte", "Bool")),
}
_LARGEST = 10**8  # entries; no array of a hand comes near


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


# The pure-Python unpickler: the C one reserves memory for whatever memo index a damaged file names.
class Reader(pickle._Unpickler):
    """An unpickler whose names are records."""

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

    Understands NumPy arrays, matrices and scalars of plain numbers, SciPy's csc and csr matrices (made dense), and
    chumpy's `Ch` and `Select`.

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
    if rows * columns > _LARGEST or len(starts) != outer + 1 or len(indices) != len(data):
        raise ValueError(f"a sparse matrix of {rows} x {columns} whose parts do not fit together")
    if indices.size and not 0 <= indices.min() <= indices.max() < inner:
        raise ValueError(f"a sparse matrix of {rows} x {columns} with indices outside it")
    dense = np.zeros((outer, inner), data.dtype)
    np.add.at(dense, (np.repeat(np.arange(outer), np.diff(starts)), indices), data)
    return dense.T if by_column else dense
