"""NumPy functions called from compiled JAX functions that stay the same from process to process.

`jax.pure_callback` bakes a pointer into what is compiled, so that JAX keeps no compilation that holds one, and every
start compiles anew. Here the compiled function calls one handler by its name and gives it a number that says which
function is meant, as XLA's foreign function interface provides for (`xla/ffi/api/c_api.h`, which jaxlib ships and whose
layout the structures below have). The number is an array like any other: what was compiled with one function calls
another when it is given another number.
"""

import ctypes
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

_TARGET = "mjx_hand_host_call"
_API_VERSION = (0, 3)  # of the interface that the structures below are written for
_INTERNAL_ERROR = 13
_METADATA_EXTENSION = 1
_NAMES = {1: "bool", 4: "int32", 5: "int64", 8: "uint32", 9: "uint64", 11: "float32", 12: "float64"}
_TYPES = {number: np.dtype(name) for number, name in _NAMES.items()}

_numbers = itertools.count()
# For good: what was dispatched may run after everything that Python holds of it is gone.
_functions: dict[int, Callable[..., Sequence[np.ndarray]]] = {}


class HostCallback:
    """A pure function of NumPy arrays with leading batch axes, to be called within compiled functions.

    It is kept until the process ends. Numbers are given in the order of making, so a program that is started again
    finds what it compiled.

    Args:
        function: from arrays to a tuple of arrays; `jax.vmap` gives it all arguments with the same leading axes. It
            must not call JAX, and must not keep the arrays, whose memory is XLA's.

    Attributes:
        number: what `call_host` knows it by.
    """

    def __init__(self, function: Callable[..., Sequence[np.ndarray]]):
        self.number = next(_numbers)
        _functions[self.number] = function

    def __call__(self, shapes: tuple[jax.ShapeDtypeStruct, ...], *args: Array) -> tuple[Array, ...]:
        """Call it within a JAX function; `shapes` are those of the results without batch axes."""
        return call_host(jnp.asarray(self.number, jnp.int32), shapes, *args)


def call_host(number: Int[Array, ""], shapes: tuple[jax.ShapeDtypeStruct, ...], *args: Array) -> tuple[Array, ...]:
    """Call the `HostCallback` of this number within a JAX function.

    Args:
        number: of the function; the same for all elements of a batch.
        shapes: of the results without batch axes.
        args: what it is given.
    """
    if jax.default_backend() != "cpu":  # whose arrays JAX itself must bring to the host
        return jax.pure_callback(_dispatch, shapes, number, *args, vmap_method="broadcast_all")
    return tuple(jax.ffi.ffi_call(_TARGET, shapes, vmap_method="broadcast_all")(number, *args))


def _dispatch(number: Any, *args: Any) -> Sequence[np.ndarray]:
    """What the function of this number, which each element of a batch tells anew, makes of the arrays."""
    numbers = np.asarray(number).ravel()
    first = int(numbers[0])
    if numbers.size > 1 and (numbers != first).any():
        raise ValueError("one call is for one host function; these elements of a batch name several")
    return _functions[first](*map(np.asarray, args))  # JAX arrays, where JAX itself makes the call


class _Buffer(ctypes.Structure):
    _fields_ = (
        ("struct_size", ctypes.c_size_t),
        ("extension", ctypes.c_void_p),
        ("dtype", ctypes.c_int),
        ("data", ctypes.c_void_p),
        ("rank", ctypes.c_int64),
        ("dims", ctypes.POINTER(ctypes.c_int64)),
    )


class _Buffers(ctypes.Structure):
    _fields_ = (
        ("struct_size", ctypes.c_size_t),
        ("extension", ctypes.c_void_p),
        ("size", ctypes.c_int64),
        ("types", ctypes.c_void_p),
        ("items", ctypes.POINTER(ctypes.POINTER(_Buffer))),
    )


class _Version(ctypes.Structure):
    _fields_ = (
        ("struct_size", ctypes.c_size_t),
        ("extension", ctypes.c_void_p),
        ("major", ctypes.c_int),
        ("minor", ctypes.c_int),
    )


class _Metadata(ctypes.Structure):
    _fields_ = (("struct_size", ctypes.c_size_t), ("version", _Version))  # and what may stay as it is


class _Extension(ctypes.Structure):
    _fields_ = (
        ("struct_size", ctypes.c_size_t),
        ("type", ctypes.c_int),
        ("next", ctypes.c_void_p),
        ("metadata", ctypes.POINTER(_Metadata)),
    )


class _Failure(ctypes.Structure):
    _fields_ = (
        ("struct_size", ctypes.c_size_t),
        ("extension", ctypes.c_void_p),
        ("message", ctypes.c_char_p),
        ("code", ctypes.c_int),
    )


class _Api(ctypes.Structure):
    _fields_ = (
        ("struct_size", ctypes.c_size_t),
        ("extension", ctypes.c_void_p),
        ("version", _Version),
        ("internal", ctypes.c_void_p),
        ("error", ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.POINTER(_Failure))),
    )


class _Call(ctypes.Structure):
    _fields_ = (
        ("struct_size", ctypes.c_size_t),
        ("extension", ctypes.POINTER(_Extension)),
        ("api", ctypes.POINTER(_Api)),
        ("context", ctypes.c_void_p),
        ("stage", ctypes.c_int),
        ("arguments", _Buffers),
        ("results", _Buffers),  # and attributes, of which these calls have none
    )


def _array(buffer: _Buffer) -> np.ndarray:
    """The buffer's own memory."""
    shape = tuple(buffer.dims[: buffer.rank])
    dtype = _TYPES[buffer.dtype]
    size = math.prod(shape) * dtype.itemsize  # np.prod takes longer than all else here
    if not size:
        return np.empty(shape, dtype)
    memory: Any = (ctypes.c_char * size).from_address(buffer.data)
    return np.ndarray(shape, dtype, memory)


def _arrays(buffers: _Buffers) -> list[np.ndarray]:
    return [_array(buffers.items[k].contents) for k in range(buffers.size)]


@ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.POINTER(_Call))
def _handler(pointer: Any) -> int | None:
    """Null, or XLA's error, which becomes an exception where the compiled function was called."""
    call = pointer.contents
    if call.extension and call.extension.contents.type == _METADATA_EXTENSION:  # asked as it is registered
        version = call.extension.contents.metadata.contents.version
        version.major, version.minor = _API_VERSION
        return None
    try:
        results = _dispatch(*_arrays(call.arguments))
        for space, result in zip(_arrays(call.results), results, strict=True):
            if space.shape != result.shape or space.dtype != result.dtype:
                raise TypeError(f"expected {space.dtype}{space.shape}, got {result.dtype}{result.shape}")
            space[...] = result
    except BaseException as error:
        message = f"{type(error).__name__}: {error}".encode()
        failure = _Failure(ctypes.sizeof(_Failure), None, message, _INTERNAL_ERROR)
        return call.api.contents.error(ctypes.byref(failure))
    return None


jax.ffi.register_ffi_target(_TARGET, jax.ffi.pycapsule(ctypes.cast(_handler, ctypes.c_void_p).value), platform="cpu")
