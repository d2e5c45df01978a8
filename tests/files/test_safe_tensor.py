"""Tensors from pickles that PyTorch 2.13 wrote, and from ones that were tampered with."""

import base64
import pickle
import sys
import zlib
from typing import Any

import numpy as np
import pytest

from mjx_hand.files import safe_pickle
from mjx_hand.files.safe_tensor import is_tensor, tensor
from tests.files.torch_layout import Tensor, dumps

# pickle.dumps({"f": torch.arange(6.0).reshape(1, 2, 3) / 4, "t": torch.arange(6, dtype=torch.float64).reshape(2, 3).T})
WRITTEN = zlib.decompress(
    base64.b64decode(
        "eNrVkL9P4zAUx+0ktKfy46rjFjbGIKGqjQqiy7VCiMXi95IFWW1iSJAvrh0HCaRKWQ4OlA2zMTDyr7GxIjHwSoruJBhuvSc9P+v56/fjkzu32E"
        "ZvNjJugY9MMaOFCqIGzXTMU1N8o4oNspiHVLMkFYqeeuYGpLOlLIXQP2amqFMu+iE9UuInHZxploJqfR4jlFvXNf5yt/m8ePKwu9DIra1HG86R"
        "RK5fh75DJbQIBKenTKWxSCQGgT8LLzzWmjPKkjDuJ9L67dcgqc+GjKbxOUulPZKO609BMo2E0nKKWP54mTjRskIc3xnXEMmxrBIny6Cn61fH4n"
        "JkiYK3FWqbMLg+KJM1if050HTazVa7ueY1O57ntWVZNxhm0iaVbS2dPah2KNFnWtxvVNDflv+Ao4tQDzwHv++aX2bfEEQwsYh9aUiF2ARfmqti"
        "GjhwFmjAAOind1TIFAs34kADzaV9o+FfgbWJHDeqri//D3Q3RDbg7DO8rdW1ldbqSsf7B7x/tB/wvttTd3LpleHLJNYn8XvvHbtNrAsD8O0Lcx"
        "V9nWDNGq96HtOi"
    )
)


def read(data: bytes) -> Any:
    return safe_pickle.unpickle(data, "file", "recording", "its publisher")


def test_what_pytorch_wrote_is_read_without_pytorch():
    found = read(WRITTEN)
    assert all(is_tensor(value) for value in found.values())
    np.testing.assert_array_equal(tensor(found["f"]), np.arange(6, dtype=np.float32).reshape(1, 2, 3) / 4)
    np.testing.assert_array_equal(tensor(found["t"]), np.arange(6.0).reshape(2, 3).T)  # not contiguous
    assert tensor(found["f"]).dtype == np.float32
    assert "torch" not in sys.modules


@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", "i8"])
@pytest.mark.parametrize("shape", [(), (0, 3), (2, 3), (4, 1, 5)])
def test_the_layout_that_tests_write_is_the_same(dtype, shape):
    array = np.random.default_rng(0).normal(scale=9, size=shape).astype(dtype)
    found = tensor(read(dumps({"a": Tensor(array)}))["a"])
    np.testing.assert_array_equal(found, array)
    assert found.dtype == array.dtype


def test_other_values_are_no_tensors():
    assert not any(is_tensor(value) for value in (3, "a", np.zeros(3), read(pickle.dumps({"a": np.zeros(2)}))["a"]))


@pytest.mark.parametrize(
    ("place", "value"),
    [(1, 5), (1, -1), (2, (4, 2, 3)), (2, (1, 2)), (3, (6, 3, 2)), (3, (6, -3, 1)), (0, None)],
)
def test_a_tensor_that_reaches_beyond_its_numbers_is_refused(place, value):
    record = read(WRITTEN)["f"]
    record.args = tuple(value if k == place else given for k, given in enumerate(record.args))
    with pytest.raises((ValueError, TypeError)):
        tensor(record)


def test_cut_off_numbers_are_refused():
    record = read(WRITTEN)["f"]
    storage = record.args[0]
    storage.args = (storage.args[0][:-4],)
    with pytest.raises(ValueError, match="a tensor of 6 numbers that holds 5"):
        tensor(record)
