"""Kept arrays: found again, made anew when an ingredient changes or the file is damaged, absent without a cache."""

import os

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.files import array_cache as module
from mjx_hand.files.array_cache import cached, model_bytes


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "_cache", lambda: str(tmp_path))
    return tmp_path / "arrays"


class Counted:
    def __init__(self):
        self.calls = 0

    def __call__(self) -> dict[str, np.ndarray]:
        self.calls += 1
        return {"a": np.linspace(0, 1, 1000), "n": np.arange(self.calls, self.calls + 3, dtype=np.int32)}


def test_found_again_exactly(folder):
    compute = Counted()
    ingredients = ("x", 3, None, (jnp.arange(4.0), {"b": b"12"}))
    first, second = cached(compute, *ingredients), cached(compute, *ingredients)
    assert compute.calls == 1
    assert first.keys() == second.keys()
    for name in first:
        assert first[name].dtype == second[name].dtype
        np.testing.assert_array_equal(first[name], second[name])


def test_what_a_kill_left_of_them_goes(folder):
    cached(Counted())
    (path,) = folder.iterdir()
    path.unlink()
    (folder / f".{path.name}-abcdefgh").mkdir()
    (folder / f".{path.name}-abcdefgh" / path.name).write_bytes(b"half a file")
    cached(Counted())
    assert list(folder.iterdir()) == [path]


@pytest.mark.parametrize(
    "other",
    [("y", 3, np.arange(4.0)), ("x", 3.0, np.arange(4.0)), ("x", 3, np.arange(4)), ("x", 3, np.arange(4.0)[::-1])],
)
def test_every_ingredient_counts(folder, other):
    compute = Counted()
    cached(compute, "x", 3, np.arange(4.0))
    cached(compute, *other)
    assert compute.calls == 2


def test_code_and_libraries_count(folder, monkeypatch):
    compute = Counted()
    cached(compute)
    monkeypatch.setattr(module, "version", lambda name: "another")
    cached(compute)
    assert compute.calls == 2


def test_a_model_is_an_ingredient_with_all_its_numbers(folder):
    xml = '<mujoco><worldbody><body><freejoint/><geom size="{}"/></body></worldbody></mujoco>'
    small, large, again = (model_bytes(mujoco.MjModel.from_xml_string(xml.format(s))) for s in (0.1, 0.2, 0.1))
    assert small == again != large


@pytest.mark.parametrize("damage", ["cut", "flip"])
def test_a_damaged_file_is_made_anew(folder, damage):
    compute = Counted()
    cached(compute, "x")
    (path,) = folder.glob("*.npz")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content[:100] if damage == "cut" else content)
    cached(compute, "x")
    assert compute.calls == 2
    cached(compute, "x")
    assert compute.calls == 2


def test_the_longest_unused_go(folder, monkeypatch):
    compute = Counted()
    for k in range(2):
        cached(compute, k)
    monkeypatch.setattr(module, "_MOST", sum(file.stat().st_size for file in folder.iterdir()))
    for age, path in enumerate(sorted(folder.glob("*.npz"), key=lambda p: p.stat().st_mtime_ns)):
        os.utime(path, (1000 + age, 1000 + age))
    cached(compute, 0)  # used: the other one is the oldest now
    cached(compute, 2)
    assert len(list(folder.iterdir())) == 2
    cached(compute, 0)
    assert compute.calls == 3
    cached(compute, 1)
    assert compute.calls == 4
    monkeypatch.setattr(module, "_MOST", 0)
    cached(compute, 3)
    assert len(list(folder.iterdir())) == 1  # what was just made stays, however large


def test_nothing_is_written_without_a_cache(monkeypatch, tmp_path):
    monkeypatch.setattr(module, "_cache", lambda: None)
    monkeypatch.chdir(tmp_path)
    compute = Counted()
    cached(compute)
    cached(compute)
    assert compute.calls == 2
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_an_input_error(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setattr(module, "_cache", lambda: str(tmp_path / "file"))
    with pytest.raises(InputError, match="cannot write"):
        cached(Counted())
