"""No byte of a hand file is ever run."""

import contextlib
import functools
import operator
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse import coo_matrix, csc_matrix

from mjx_hand.errors import InputError
from mjx_hand.files import safe_pickle
from mjx_hand.hand.load import load_hand
from tests.hand.mano_layout import as_python2, chumpy


class Call:
    """Pickles as a call of `function`, as an attacker's file would."""

    def __init__(self, function: Any, *args: Any):
        self.call = (function, args)

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return self.call


CALLS = {
    "os.system": lambda mark: Call(os.system, f"touch {mark}"),
    "builtins.eval": lambda mark: Call(eval, f"open({str(mark)!r}, 'w')"),
    "builtins.exec": lambda mark: Call(exec, f"open({str(mark)!r}, 'w')"),
    "builtins.open": lambda mark: Call(open, str(mark), "w"),
    "subprocess.Popen": lambda mark: Call(subprocess.Popen, ["touch", str(mark)]),
    "builtins.getattr": lambda mark: Call(getattr, str(mark), "upper"),
    "builtins.__import__": lambda mark: Call(__import__, "this"),
    "functools.partial": lambda mark: Call(functools.partial, os.system, f"touch {mark}"),
    "operator.attrgetter": lambda mark: Call(operator.attrgetter, "system"),
    # Chains: the call of a call's result, and calls in the arguments and in the state of what is allowed.
    "builtins.getattr of a call": lambda mark: Call(getattr, Call(__import__, "os"), "system"),
    "a call in an allowed call's arguments": lambda mark: Call(np.dtype, Call(os.system, f"touch {mark}")),
    "a call in an array": lambda mark: np.array([Call(os.system, f"touch {mark}")], dtype=object),
    "a call in a set": lambda mark: {"x": [Call(set, [Call(os.system, f"touch {mark}")])]},
    "a placeholder's argument": lambda mark: {
        "v_template": csc_matrix((1, 1)),
        "x": [Call(os.system, f"touch {mark}")],
    },
}


@pytest.mark.parametrize("protocol", range(6))
@pytest.mark.parametrize("name", CALLS)
def test_calls_are_refused_by_name_and_not_run(tmp_path: Path, name: str, protocol: int) -> None:
    mark = tmp_path / "ran"
    path = tmp_path / "MANO_RIGHT.pkl"
    path.write_bytes(pickle.dumps({"v_template": CALLS[name](mark)}, protocol))
    with pytest.raises(InputError, match="refused, since it names") as caught:
        load_hand(path)
    assert not mark.exists()
    assert "\n" not in str(caught.value)
    if "." in name and name != "os.system":
        assert re.search(name.split(".")[1].split()[0] + "|__import__", str(caught.value))
    elif name == "os.system":
        assert "posix.system" in str(caught.value) or "nt.system" in str(caught.value)


def stack_global(module: str, name: str) -> bytes:
    def text(value: str) -> bytes:
        return pickle.SHORT_BINUNICODE + bytes([len(value)]) + value.encode()

    return b"\x80\x04" + text(module) + text(name) + b"\x93"


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("numpy", "load"),
        ("numpy.testing._private.utils", "runstring"),
        ("numpy._core.multiarray", "fromfile"),
        ("numpy.f2py", "compile"),
        ("numpy", "ndarray.tofile"),
        ("numpy", "dtype.__class__.__base__"),
        ("numpy", "os.system"),
        ("scipy.sparse", "load_npz"),
        ("scipy.sparse._csc", "csc_matrix.__init__.__globals__"),
        ("scipy.io.matlab", "loadmat"),
        ("chumpy.ch", "ChLambda"),
        ("chumpy", "os.system"),
        ("builtins", "object.__subclasses__"),
        ("copyreg", "__newobj__"),
        ("copyreg", "add_extension"),
        ("_codecs", "lookup"),
        ("mjx_hand.files.safe_pickle", "Reader"),
        ("__main__", "x"),
        ("", ""),
    ],
)
def test_names_hidden_under_trusted_packages_are_refused(module: str, name: str) -> None:
    with pytest.raises(InputError, match="refused, since it names"):
        safe_pickle.read(stack_global(module, name) + b")R.", "file")
    if "." not in name:
        old_style = b"c" + module.encode() + b"\n" + name.encode() + b"\n)R."
        with pytest.raises(InputError, match="refused, since it names"):
            safe_pickle.read(old_style, "file")


@pytest.mark.parametrize(
    "data",
    [
        b"(S'touch ran'\nios\nsystem\n.",  # INST
        b"(cos\nsystem\nS'touch ran'\no.",  # OBJ
        b"\x80\x02cos\nsystem\nS'touch ran'\n\x85\x81.",  # NEWOBJ
        b"\x80\x04cos\nsystem\nS'touch ran'\n\x85}\x92.",  # NEWOBJ_EX
        b"\x80\x02cnumpy\ndtype\nS'f8'\n\x85R(cos\nsystem\nS'touch ran'\ntRb.",  # in the state of what is allowed
        b"\x80\x02cnumpy.core.multiarray\n_reconstruct\n(cos\nsystem\nS'x'\ntR.",  # in its arguments
    ],
    ids=["INST", "OBJ", "NEWOBJ", "NEWOBJ_EX", "state", "arguments"],
)
def test_every_opcode_that_calls_is_refused(data: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"refused, since it names 'os\.system'"):
        safe_pickle.read(data, "file")
    assert not list(tmp_path.iterdir())


class Watch:
    """What Python's own audit events report while `on`: a hook cannot be taken off, so it is put up once."""

    def __init__(self) -> None:
        self.on, self.seen = False, []
        sys.addaudithook(self.hear)

    def hear(self, event: str, _: tuple[Any, ...]) -> None:
        if self.on:
            self.seen.append(event)


WATCH = Watch()


@pytest.mark.parametrize("name", CALLS)
def test_reading_imports_runs_and_opens_nothing(tmp_path: Path, name: str) -> None:
    data = pickle.dumps({"v_template": CALLS[name](tmp_path / "ran")}, 2)
    WATCH.seen.clear()
    WATCH.on = True
    try:
        with contextlib.suppress(InputError):
            safe_pickle.read(data, "file")
    finally:
        WATCH.on = False
    harmless = {"object.__getattr__", "object.__setattr__", "marshal.loads"}
    assert set(WATCH.seen) <= harmless, WATCH.seen


@pytest.mark.parametrize("data", [b"Pid\n.", b"\x80\x02NQ."], ids=["PERSID", "BINPERSID"])
def test_persistent_ids_are_refused(data: bytes) -> None:
    with pytest.raises(InputError, match="persistent id"):
        safe_pickle.read(data, "file")


@pytest.mark.parametrize("data", [b"\x82\x01.", b"\x83\x01\x00.", b"\x84\x01\x00\x00\x00."])
def test_extension_codes_are_refused(data: bytes) -> None:
    with pytest.raises(InputError, match="not a readable pickle"):
        safe_pickle.read(data, "file")


def test_a_file_cannot_alter_how_the_next_one_is_read() -> None:
    """BUILD on a class would set attributes on it; every load makes its classes anew."""
    planted = b"cnumpy\nndarray\n(NU\x0c__setstate__Ndtb."  # (None, {"__setstate__": None}) as the class's slot state
    with pytest.raises(InputError):
        safe_pickle.read(planted, "file")
    value = np.arange(6.0).reshape(2, 3)
    np.testing.assert_array_equal(safe_pickle.array(safe_pickle.read(pickle.dumps({"a": value}), "file")["a"]), value)


def test_known_objects_are_records_and_not_the_real_thing() -> None:
    read = safe_pickle.read(pickle.dumps({"a": np.zeros(3), "m": csc_matrix((2, 2))}), "file")
    assert not isinstance(read["a"], np.ndarray)
    assert type(read["m"]).__module__ == "mjx_hand.files.safe_pickle"


@pytest.mark.parametrize("protocol", range(6))
@pytest.mark.parametrize(
    "value",
    [
        np.arange(12, dtype=np.int32).reshape(3, 4),
        np.asfortranarray(np.arange(12.0).reshape(3, 4)),
        np.arange(12, dtype=">u2")[::2],
        np.array([True, False]),
        np.float32(2.5),
    ],
    ids=["int", "fortran", "big-endian", "bool", "scalar"],
)
def test_arrays_keep_their_values_through_every_protocol(value: Any, protocol: int) -> None:
    found = safe_pickle.array(safe_pickle.read(pickle.dumps({"a": value}, protocol), "file")["a"])
    np.testing.assert_array_equal(found, value)
    assert found.dtype == np.asarray(value).dtype.newbyteorder("=")


def test_python2_strings_become_arrays() -> None:
    value = np.random.default_rng(0).normal(size=(4, 5))  # its bytes are no valid UTF-8
    np.testing.assert_array_equal(safe_pickle.array(safe_pickle.read(as_python2({"a": value}), "f")["a"]), value)


@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("indices", np.array([0, 5])),
        ("indices", np.array([0, -1])),
        ("indptr", np.array([0, 1])),
        ("indptr", np.array([0, 9, 2])),
        ("indptr", np.array([0, 1, 3 * 10**8])),
        ("indptr", np.array([1, 2, 2])),
        ("_shape", (10**9, 2)),
        ("_shape", None),
        ("data", np.zeros(9)),
    ],
)
def test_contradictory_sparse_matrices_are_refused(part: str, value: Any) -> None:
    matrix = csc_matrix(np.eye(2))
    setattr(matrix, part, value)
    record = safe_pickle.read(pickle.dumps({"m": matrix}), "file")["m"]
    with pytest.raises((ValueError, TypeError)):
        safe_pickle.array(record)


@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("_shape", (10**5, 10**5)),
        ("_shape", (-2, -2)),
        ("data", np.ones(3)),
        ("coords", (np.array([0, 2]), np.array([0, 1]))),
        ("coords", (np.array([0, -1]), np.array([0, 1]))),
        ("coords", (np.array([0.0, 1.0]), np.array([0, 1]))),
        ("coords", (np.array([0, 1]),)),
    ],
)
def test_contradictory_lists_of_entries_are_refused(part: str, value: Any) -> None:
    matrix = coo_matrix(np.eye(2))
    assert np.array_equal(safe_pickle.array(safe_pickle.read(pickle.dumps({"m": matrix}), "f")["m"]), np.eye(2))
    setattr(matrix, part, value)
    with pytest.raises((ValueError, TypeError)):
        safe_pickle.array(safe_pickle.read(pickle.dumps({"m": matrix}), "file")["m"])


def test_selection_outside_its_source_is_refused() -> None:
    with chumpy() as ch:
        data = pickle.dumps({"s": ch.Select(a=ch.Ch(x=np.zeros(3)), idxs=np.array([7]))})
    with pytest.raises(IndexError):
        safe_pickle.array(safe_pickle.read(data, "file")["s"])


@pytest.mark.parametrize("value", [[1, 2], "text", None, 3.0])
def test_a_pickle_without_a_dictionary_is_refused(value: Any) -> None:
    with pytest.raises(InputError, match=f"holds a {type(value).__name__}, expected a MANO file's dictionary"):
        safe_pickle.read(pickle.dumps(value), "file")


@pytest.mark.parametrize("data", [b"", b"\x80", b"not a pickle", b"\x80\x63.", bytes(100)])
def test_what_is_no_pickle_is_refused(data: bytes) -> None:
    with pytest.raises(InputError, match="not a readable pickle"):
        safe_pickle.read(data, "file")
