"""PyTorch's tensors in a pickle, as NumPy arrays and without PyTorch.

A pickled tensor names the function that would rebuild it, its storage, offset, size and stride. The storage is bytes in
PyTorch's older file form (https://github.com/pytorch/pytorch/blob/main/torch/serialization.py, `_legacy_save`): five
pickles (a magic number, a protocol, the machine's sizes, the storage's kind and length, its key), then the length again
and the numbers themselves.
"""

import io
from typing import Any

import numpy as np

from mjx_hand.files.safe_pickle import Reader, Record, bytes_of

_MAGIC = 0x1950A86A20F9469CFC6C
_KINDS = {
    "Half": "f2",
    "Float": "f4",
    "Double": "f8",
    "Int": "i4",
    "Long": "i8",
    "Short": "i2",
    "Char": "i1",
    "Byte": "u1",
    "Bool": "b1",
}


class _StorageReader(Reader):
    """A reader to which the storage that a tensor's bytes describe is no external object, but what it was called."""

    def persistent_load(self, pid: Any) -> Any:
        return pid


def is_tensor(value: Any) -> bool:
    """Whether a value of an unpickled file stands for a tensor."""
    return isinstance(value, Record) and value.name == "torch._utils._rebuild_tensor_v2"


def tensor(value: Record) -> np.ndarray:
    """The array of a record for which `is_tensor` holds.

    Raises:
        ValueError: it contradicts itself.
    """
    storage, offset, size, stride = value.args[:4]
    numbers = _storage(storage)
    reach = 1 + offset + sum((n - 1) * step for n, step in zip(size, stride, strict=True))
    if min((offset, *size, *stride), default=0) < 0 or (0 not in size and reach > len(numbers)):
        raise ValueError(f"a tensor of size {tuple(size)} that its {len(numbers)} numbers do not fill")
    if 0 in size:
        return np.zeros(size, numbers.dtype)
    strides = [step * numbers.itemsize for step in stride]
    return np.lib.stride_tricks.as_strided(numbers[offset:], size, strides, writeable=False).copy()


def _storage(record: Any) -> np.ndarray:
    if not isinstance(record, Record) or record.name != "torch.storage._load_from_bytes":
        raise ValueError("a tensor without its numbers")
    stream = io.BytesIO(bytes_of(record.args[0]))
    magic, _, machine, described, _ = (_StorageReader(stream, encoding="latin1").load() for _ in range(5))
    if magic != _MAGIC or not machine["little_endian"]:
        raise ValueError("a tensor in a form that is not known here")
    _, kind, _, _, length, *_ = described
    code = _KINDS[kind.name.removeprefix("torch.").removesuffix("Storage")]
    again = int.from_bytes(stream.read(8), "little")
    numbers = np.frombuffer(stream.read(), np.dtype("<" + code)).astype(code)
    if not length == again == len(numbers):
        raise ValueError(f"a tensor of {length} numbers that holds {len(numbers)}")
    return numbers
