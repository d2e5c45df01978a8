"""Files with pickles in them: what is read, and that nothing is run."""

import io
import os
import pickle
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.files.contents import WHOLE, plain, read_contents
from tests.files.torch_layout import Tensor, dumps


class Evil:
    """Makes a folder when a pickle of it is loaded in earnest."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def hidden_in(folder, kind: str, value):
    path = folder / f"file{kind}"
    if kind == ".pkl":
        path.write_bytes(pickle.dumps({"raw_mano": {0: value}}))
    elif kind == ".npy":
        np.save(path, np.array({"right": {"rot": value}}, dtype=object))
    else:
        np.savez(path, framerate=120.0, rhand=np.array({"params": {"transl": value}}, dtype=object))
    return path


@pytest.mark.parametrize("kind", [".pkl", ".npy", ".npz"])
def test_code_in_a_file_is_refused_by_name_and_not_run(tmp_path, kind):
    path = hidden_in(tmp_path, kind, Evil(tmp_path / "made"))
    with pytest.raises(
        InputError, match=r"refused, since it names '(posix|nt)\.mkdir', which no recording needs"
    ) as refusal:
        load_motion(path)
    assert "\n" not in str(refusal.value)
    assert not (tmp_path / "made").exists()


def test_code_in_a_tensors_own_bytes_is_refused_too(tmp_path):
    data = dumps({"a": Tensor(np.zeros(3, "f4"))})
    evil = pickle.dumps(Evil(tmp_path / "made"), 2)
    start = data.index(b"\x8a\x0al\xfc\x9cF\xf9")  # the storage's first pickle, its magic number
    path = tmp_path / "a.pkl"
    path.write_bytes(data[: start - 2] + evil + data[start - 2 + len(evil) :])
    with pytest.raises(InputError, match="cannot read 'a'"):
        plain(path, "a", read_contents(path)["a"])
    assert not (tmp_path / "made").exists()


@given(
    value=st.dictionaries(
        st.text(st.characters(categories=["L"]), min_size=1),
        st.sampled_from(["f4", "f8", "i4", "i8", "u1"]).flatmap(
            lambda d: arrays(d, array_shapes(max_dims=3, max_side=4))
        ),
        max_size=4,
    ),
    protocol=st.integers(0, 5),
)
def test_arrays_come_back_from_pickles_of_every_protocol(tmp_path_factory, value, protocol):
    path = tmp_path_factory.mktemp("p") / "a.pkl"
    path.write_bytes(pickle.dumps(value, protocol))
    found = read_contents(path)
    assert found.keys() == value.keys()
    for name, array in value.items():
        np.testing.assert_array_equal(plain(path, name, found[name]), array)


def test_arrays_and_objects_side_by_side_in_an_archive(tmp_path):
    path = tmp_path / "a.npz"
    listed = np.empty(2, object)
    listed[:] = [np.zeros(2), {"b": np.ones(3)}]
    np.savez(path, a=np.arange(3), lone=np.array({"c": 4}), listed=listed, name="seq")
    found = read_contents(path)
    np.testing.assert_array_equal(found["a"], np.arange(3))
    assert (found["lone"]["c"], str(found["name"])) == (4, "seq")
    np.testing.assert_array_equal(plain(path, "b", found["listed"][1]["b"]), np.ones(3))


def test_lone_values_and_other_files(tmp_path):
    np.save(tmp_path / "a.npy", np.arange(3))
    np.testing.assert_array_equal(read_contents(tmp_path / "a.npy")[WHOLE], np.arange(3))
    (tmp_path / "b.pkl").write_bytes(pickle.dumps([1, 2]))
    assert read_contents(tmp_path / "b.pkl") == {WHOLE: [1, 2]}
    (tmp_path / "c.txt").write_text("c")
    assert read_contents(tmp_path / "c.txt") == read_contents(tmp_path) == {}


def test_nested_lists_are_stacked_and_what_is_no_array_is_named(tmp_path):
    found = plain(tmp_path, "a", [[1.0, 2.0], (3.0, 4.0)])
    np.testing.assert_array_equal(found, [[1.0, 2.0], [3.0, 4.0]])
    for value in ("text", None, {"a": 1}, [[1.0], [1.0, 2.0]], [1.0, "a"]):
        with pytest.raises(InputError, match="cannot read 'a'"):
            plain(tmp_path, "a", value)


@pytest.mark.parametrize("kind", [".pkl", ".npy", ".npz"])
@pytest.mark.parametrize("keep", [0.02, 0.5, 0.98])
def test_truncated_files_are_named_in_one_line(tmp_path, kind, keep):
    path = hidden_in(tmp_path, kind, np.random.default_rng(0).normal(size=(50, 3)))
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * keep)])
    with pytest.raises(InputError, match=r"not a readable|cannot read") as refusal:
        load_motion(path)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("kind", [".pkl", ".npy", ".npz"])
@pytest.mark.parametrize("seed", range(12))
def test_flipped_bytes_never_raise_anything_else(tmp_path, kind, seed):
    path = hidden_in(tmp_path, kind, np.zeros((3, 3)))
    rng = np.random.default_rng(seed)
    data = bytearray(path.read_bytes())
    for place in rng.integers(0, len(data), 3):
        data[place] = rng.integers(256)
    path.write_bytes(data)
    with pytest.raises(InputError):
        load_motion(path)


def test_an_archive_with_a_password_or_of_other_things_is_named(tmp_path):
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.npy", b"not an array")
    with pytest.raises(InputError, match=r"a\.npz: a: not a readable \.npy array"):
        load_motion(path)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("readme.txt", "hello")
    path.write_bytes(out.getvalue())
    with pytest.raises(InputError, match="not a recording that is known here"):
        load_motion(path)
