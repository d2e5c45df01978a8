"""Archives that are damaged, lie about themselves or unpack to far more than their size."""

import contextlib
import io
import struct
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import text, texts
from mjx_hand.files.contents import read_contents
from mjx_hand.files.npz_archive import load_arrays, open_arrays, save_arrays, schema_of

HEADER = "{'descr': '<f8', 'fortran_order': False, 'shape': (%s), }"


def npy(header: str, data: bytes = b"") -> bytes:
    text = header.encode("latin1").ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def written(path: Path, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return path


def array(value: object) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.asarray(value))
    return stream.getvalue()


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    save_arrays(tmp_path / "a.npz", "s/1", {"x": np.arange(300.0).reshape(100, 3), "name": "abc"})
    return tmp_path / "a.npz"


def everything(path: Path) -> dict[str, np.ndarray]:
    return dict(load_arrays(path, "s/1"))


def refused_in_a_line(path: Path) -> None:
    with pytest.raises(InputError) as refusal:
        everything(path)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 1000


def test_any_bit_of_the_directory_is_noticed_or_harmless(sound):
    good = {name: value.tobytes() for name, value in everything(sound).items()}
    content = sound.read_bytes()
    start = content.index(b"PK\x01\x02")
    for bit in range(8 * start, 8 * len(content), 5):
        damaged = bytearray(content)
        damaged[bit // 8] ^= 1 << bit % 8
        sound.write_bytes(damaged)
        with contextlib.suppress(InputError):  # whose message is always one line
            found = {name: value.tobytes() for name, value in everything(sound).items()}
            assert all(good.get(name, value) == value for name, value in found.items())


@pytest.mark.parametrize(("offset", "value"), [(10, 99), (8, 1), (10, 12), (10, 14)])
def test_other_methods_and_locks_are_refused(sound, offset, value):
    content = bytearray(sound.read_bytes())
    for mark, shift in ((b"PK\x01\x02", 0), (b"PK\x03\x04", -2)):
        content[content.find(mark) + offset + shift] = value
    sound.write_bytes(content)
    refused_in_a_line(sound)
    assert schema_of(sound) == ""


@pytest.mark.parametrize(
    "member",
    [
        npy(HEADER % "10**12,"),
        npy(HEADER % "1000000000000,"),
        npy(HEADER % "-1,"),
        npy(HEADER % "0, 10000000000000"),
        npy("{'descr': '<U0', 'fortran_order': False, 'shape': (1000000000,), }"),
        npy("{'descr': '|V0', 'fortran_order': False, 'shape': (1000000000,), }"),
        npy("{"),
        npy("(" * 115),
        npy("{'descr': '|O', 'fortran_order': False, 'shape': (), }", b"N."),
        npy(HEADER % "2,", b"\0" * 15),
        npy(HEADER % "2,", b"\0" * 17),
        npy(HEADER % ("9" * 50)),
        npy("{'descr': '<U1', 'fortran_order': False, 'shape': (1,), }", b"\xff\xff\xff\x7f"),
        b"not an array",
        b"",
    ],
)
def test_members_that_are_not_what_they_say(tmp_path, member):
    refused_in_a_line(written(tmp_path / "a.npz", schema=array("s/1"), x=member))


def test_what_nobody_asks_for_is_not_unpacked(tmp_path):
    big = npy(HEADER % "20000000,", bytes(160_000_000))
    path = written(tmp_path / "a.npz", schema=array("s/1"), x=array([1.0]), unused=big)
    del big
    tracemalloc.start()
    assert load_arrays(path, "s/1")["x"].tolist() == [1.0]
    assert read_contents(path)["x"].tolist() == [1.0]
    with pytest.raises(InputError, match="far more than the file's size"):
        load_arrays(path, "s/1")["unused"]
    assert tracemalloc.get_traced_memory()[1] < 5e6
    tracemalloc.stop()


def test_two_arrays_of_one_name_are_refused(tmp_path):
    path = written(tmp_path / "a.npz", x=array([1.0]))
    with pytest.warns(UserWarning, match="Duplicate name"), zipfile.ZipFile(path, "a") as archive:
        archive.writestr("x.npy", array([2.0]))
    for read in (open_arrays, read_contents):
        with pytest.raises(InputError, match="two arrays of one name"):
            read(path)


def test_large_recordings_are_read(tmp_path):
    save_arrays(tmp_path / "a.npz", "s/1", {"still": np.zeros((100_000, 48)), "empty": np.zeros((0, 5, 3))})
    found = everything(tmp_path / "a.npz")
    assert found["still"].shape == (100_000, 48)
    assert found["empty"].shape == (0, 5, 3)


def test_texts_are_texts(tmp_path):
    path = tmp_path / "a.npz"
    save_arrays(path, "s/1", {"name": "n", "names": np.array(["a", "b"]), "number": 3.0})
    arrays = load_arrays(path, "s/1")
    assert (text(path, arrays, "name"), texts(path, arrays, "names")) == ("n", ("a", "b"))
    for read, name in ((text, "names"), (text, "number"), (texts, "name"), (texts, "number"), (text, "gone")):
        with pytest.raises(InputError, match=f"{name}"):
            read(path, arrays, name)


def test_messages_are_one_line_whatever_the_file_says(tmp_path):
    save_arrays(tmp_path / "a.npz", "line\n\x1b[2Jbreaks" + "x" * 5000, {"x": 1.0})
    refused_in_a_line(tmp_path / "a.npz")
    with pytest.raises(InputError, match=r"line \\x1b\[2Jbreaksx"):
        everything(tmp_path / "a.npz")
