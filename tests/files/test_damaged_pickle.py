"""Damaged hand files: cut off, flipped bits, numbers out of range."""

import contextlib
import pickle
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_matrix

from mjx_hand.errors import InputError
from mjx_hand.files import safe_pickle
from mjx_hand.hand.load import load_hand
from tests.hand.mano_layout import official
from tests.hand.test_mano_file import HAND

WHOLE = official(HAND)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.1, 0.5, 0.9, 0.999])
def test_truncated_file_is_refused(tmp_path: Path, share: float) -> None:
    path = tmp_path / "MANO_RIGHT.pkl"
    path.write_bytes(WHOLE[: int(share * len(WHOLE))])
    with pytest.raises(InputError, match="not a readable pickle"):
        load_hand(path)


SKELETON = pickle.dumps({"a": np.arange(3), "m": csc_matrix(np.eye(2)), "s": "x"}, 2)


def test_file_cut_off_anywhere_is_refused() -> None:
    for end in range(len(SKELETON)):
        # In the middle of a name, what is left of it is no known name.
        with pytest.raises(InputError, match=r"not a readable pickle|refused, since it names"):
            safe_pickle.read(SKELETON[:end], "file")


@contextlib.contextmanager
def one_line_input_error() -> Iterator[None]:
    """What runs inside may succeed, or raise an `InputError` of one line; anything else fails the test."""
    try:
        yield
    except InputError as error:
        message = str(error)
    else:
        return
    assert "\n" not in message


@settings(deadline=None, max_examples=300)
@given(place=st.integers(0, 8 * len(SKELETON) - 1))
def test_flipped_bits_raise_an_input_error_or_load_inertly(place: int) -> None:
    data = bytearray(SKELETON)
    data[place // 8] ^= 1 << place % 8
    with one_line_input_error():
        for value in safe_pickle.read(bytes(data), "file").values():
            with contextlib.suppress(Exception):  # `load_mano_file` turns whatever it is into an InputError
                safe_pickle.array(value)


@settings(deadline=None, max_examples=200)
@given(data=st.binary(max_size=60), protocol=st.sampled_from([b"", b"\x80\x02", b"\x80\x04"]))
def test_random_bytes_never_run(data: bytes, protocol: bytes) -> None:
    with one_line_input_error():  # a few are pickles, such as b"}." of an empty dictionary
        safe_pickle.read(protocol + data, "file")


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_damaged_whole_files_load_or_raise_input_errors(tmp_path_factory, seed: int) -> None:
    rng = np.random.default_rng(seed)
    data = bytearray(WHOLE)
    for place in rng.integers(0, 400 if seed % 2 else len(data), 3):
        data[place] ^= 1 << int(rng.integers(8))
    path = tmp_path_factory.getbasetemp() / "damaged.pkl"
    path.write_bytes(data)
    with one_line_input_error():
        load_hand(path)


@pytest.mark.parametrize("depth", [3, 1000, 10**5])
def test_keys_that_are_no_names_are_refused(depth: int) -> None:
    nested = b"N" + b"\x85" * depth  # ((None,),) and so on
    for data in (b"}" + nested + b"Ns.", b"}(" + nested + b"Nu.", b"(" + nested + b"Nd."):
        with pytest.raises(InputError, match="not a readable pickle"):
            safe_pickle.read(b"\x80\x02" + data, "file")
    for data in (b"\x8f(" + nested + b"\x90.", b"(" + nested + b"\x91."):  # sets
        with pytest.raises(InputError, match="not a readable pickle"):
            safe_pickle.read(b"\x80\x04" + data, "file")


def test_names_numbers_and_pairs_of_them_are_keys() -> None:
    value = {"a": 1, 2: 3, 2.5: None, None: {(1, "b"): {4, 5}}, True: bytearray(b"xy")}
    assert safe_pickle.read(pickle.dumps(value, 5), "file") == value


def test_a_huge_memo_index_or_length_takes_no_memory() -> None:
    tracemalloc.start()
    for data in (
        b"\x80\x02Nr\xff\xff\xff\x7f.",
        b"\x80\x04\x8e" + (2**40).to_bytes(8, "little") + b"x.",
        b"\x80\x05\x96" + (3 * 10**9).to_bytes(8, "little") + b"x.",  # BYTEARRAY8
        b"\x80\x05\x96" + (2**64 - 1).to_bytes(8, "little") + b"x.",
    ):
        with pytest.raises(InputError):
            safe_pickle.read(data, "file")
    assert tracemalloc.get_traced_memory()[1] < 10**8
    tracemalloc.stop()
