"""Files in the layout of the official MANO ones, made from the open hand: no MANO data is needed or used.

The official files are Python 2 pickles of protocol 2 that hold NumPy arrays, a SciPy csc matrix and chumpy objects.
Stand-ins of chumpy's classes are put in `sys.modules` while a file is written, and only then.
"""

import contextlib
import io
import pickle
import struct
import sys
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.sparse import csc_matrix

from mjx_hand.hand.joints import PARENTS
from mjx_hand.hand.model import HandModel


def layout(hand: HandModel) -> dict[str, Any]:
    """The official file's keys, with plain arrays."""
    parents = np.array([2**32 - 1, *PARENTS[1:]], np.uint32)
    return {
        "v_template": hand.template.astype(np.float64),
        "f": hand.faces.astype(np.uint32),
        "weights": hand.weights.astype(np.float64),
        "J_regressor": hand.joint_regressor.astype(np.float64),
        "kintree_table": np.stack([parents, np.arange(16, dtype=np.uint32)]),
        "shapedirs": hand.shapedirs.astype(np.float64),
        "posedirs": hand.posedirs.astype(np.float64),
        "hands_mean": hand.pose_mean.ravel().astype(np.float64),
        "hands_components": np.eye(45),
        "bs_style": "lbs",
        "bs_type": "lrotmin",
    }


def write_npz(hand: HandModel, path: Path, **changes: Any) -> Path:
    np.savez(path, **(layout(hand) | changes))
    return path


@contextlib.contextmanager
def chumpy() -> Iterator[types.SimpleNamespace]:
    """Stand-ins of `chumpy.ch.Ch` and `chumpy.reordering.Select` that pickle as the real ones do."""

    class Ch:
        def __init__(self, **terms: Any):
            self.__dict__.update(terms, _dirty_vars=set(), _itr=None, _make_dense=False)

    class Select(Ch):
        pass

    modules = {name: types.ModuleType(name) for name in ("chumpy", "chumpy.ch", "chumpy.reordering")}
    for cls, module in ((Ch, "chumpy.ch"), (Select, "chumpy.reordering")):
        cls.__module__, cls.__qualname__ = module, cls.__name__
        setattr(modules[module], cls.__name__, cls)
    sys.modules.update(modules)
    try:
        yield types.SimpleNamespace(Ch=Ch, Select=Select)
    finally:
        for name in modules:
            del sys.modules[name]


_Pickler: Any = pickle._Pickler  # the one in Python, whose methods type stubs do not list


class _Python2Pickler(_Pickler):
    """Writes bytes as Python 2 wrote its strings."""

    dispatch: ClassVar = dict(_Pickler.dispatch)

    def save_bytes(self, data: bytes) -> None:
        self.write(pickle.BINSTRING + struct.pack("<i", len(data)) + data)
        self.memoize(data)

    dispatch[bytes] = save_bytes


def as_python2(value: Any) -> bytes:
    """Protocol 2 with Python 2's strings and the module names of its day."""
    out = io.BytesIO()
    _Python2Pickler(out, 2).dump(value)
    data = out.getvalue()
    for now, then in (
        (b"numpy._core.", b"numpy.core."),
        (b"scipy.sparse._csc\n", b"scipy.sparse.csc\n"),
    ):
        data = data.replace(b"c" + now, b"c" + then)
    return data


def official(hand: HandModel, protocol: int | None = None) -> bytes:
    """The whole file: Python 2's protocol 2 (None), or a protocol of today's pickle."""
    arrays = layout(hand)
    with chumpy() as ch:
        whole = np.concatenate([arrays["shapedirs"], np.full((hand.num_vertices, 3, 5), 9.0)], axis=2)
        wanted = np.arange(whole.size).reshape(whole.shape)[..., :10]
        values = arrays | {
            "J_regressor": csc_matrix(arrays["J_regressor"]),
            "posedirs": ch.Ch(x=arrays["posedirs"]),
            "shapedirs": ch.Select(a=ch.Ch(x=whole), idxs=wanted.ravel(), preferred_shape=wanted.shape),
            "v_template": ch.Ch(x=np.asfortranarray(arrays["v_template"])),
        }
        return as_python2(values) if protocol is None else pickle.dumps(values, protocol)
