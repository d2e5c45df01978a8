"""Pickles with PyTorch tensors, as PyTorch 1.6 and later write them, without PyTorch.

Stand-ins of the functions that a pickled tensor names are put in `sys.modules` while a file is written, and only then.
"""

import collections
import contextlib
import io
import pickle
import struct
import sys
import types
from collections.abc import Iterator
from typing import Any

import numpy as np

_KINDS = {"f4": "Float", "f8": "Double", "i8": "Long", "f2": "Half"}


def _rebuild_tensor_v2(*_: Any) -> None:
    raise AssertionError("nothing in a file may be called")


def _load_from_bytes(*_: Any) -> None:
    raise AssertionError("nothing in a file may be called")


class _Storage:
    def __init__(self, array: np.ndarray):
        self.array = array

    def __reduce__(self):
        kind = getattr(sys.modules["torch"], f"{_KINDS[self.array.dtype.str[1:]]}Storage")
        out = io.BytesIO()
        for part in (0x1950A86A20F9469CFC6C, 1001, {"protocol_version": 1001, "little_endian": True, "type_sizes": {}}):
            pickle.dump(part, out, 2)

        class Pickler(pickle.Pickler):
            def persistent_id(self, obj: Any) -> Any:
                return ("storage", kind, "94", "cpu", outer.array.size, None) if obj is outer else None

        outer = self
        Pickler(out, 2).dump(self)
        pickle.dump(["94"], out, 2)
        out.write(struct.pack("<q", self.array.size) + self.array.tobytes())
        return _load_from_bytes, (out.getvalue(),)


class Tensor:
    """Pickles as a contiguous `torch.Tensor` of the array."""

    def __init__(self, array: np.ndarray):
        self.array = np.ascontiguousarray(array)

    def __reduce__(self):
        stride = tuple(s // self.array.itemsize for s in self.array.strides)
        rest = (False, collections.OrderedDict())
        return _rebuild_tensor_v2, (_Storage(self.array), 0, self.array.shape, stride, *rest)


@contextlib.contextmanager
def torch() -> Iterator[None]:
    """While this lasts, `Tensor` can be pickled."""
    modules = {name: types.ModuleType(name) for name in ("torch", "torch._utils", "torch.storage")}
    for function, module in ((_rebuild_tensor_v2, "torch._utils"), (_load_from_bytes, "torch.storage")):
        function.__module__ = module
        setattr(modules[module], function.__name__, function)
    for kind in _KINDS.values():
        setattr(modules["torch"], f"{kind}Storage", type(f"{kind}Storage", (), {"__module__": "torch"}))
    sys.modules.update(modules)
    try:
        yield
    finally:
        for name in modules:
            del sys.modules[name]


def dumps(value: Any) -> bytes:
    with torch():
        return pickle.dumps(value)
