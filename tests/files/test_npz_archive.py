"""Files appear whole or not at all, and never run code."""

import pickle
import stat

import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import load_arrays, open_arrays, replacing, save_arrays


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.npz"
    path.write_text("old")

    def fail_half_way() -> None:
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise KeyError

    with pytest.raises(KeyError):
        fail_half_way()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_symbolic_link_stays_and_what_it_names_is_written(tmp_path):
    (tmp_path / "disk").mkdir()
    target, link = tmp_path / "disk" / "real.npz", tmp_path / "link.npz"
    link.symlink_to("disk/real.npz")
    (tmp_path / "again.npz").symlink_to(link)
    for path in (link, tmp_path / "again.npz"):  # the first writes where nothing is yet
        save_arrays(path, "s/1", {"x": 1.0})
        assert path.is_symlink()
        assert not target.is_symlink()
        assert load_arrays(target, "s/1")["x"] == 1.0
        target.unlink()
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["again.npz", "disk", "link.npz"]
    (tmp_path / "a.npz").symlink_to("b.npz")
    (tmp_path / "b.npz").symlink_to("a.npz")
    with pytest.raises(InputError, match="in a circle"):
        save_arrays(tmp_path / "a.npz", "s/1", {"x": 1.0})


def test_new_file_has_an_ordinary_files_mode(tmp_path):
    save_arrays(tmp_path / "a.npz", "s/1", {"x": 1.0})
    (tmp_path / "plain").touch()
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("a.npz", "plain")]
    assert modes[0] == modes[1]


def test_folders_are_made_and_unwritable_places_refused(tmp_path):
    save_arrays(tmp_path / "new" / "folder" / "a.npz", "s/1", {"x": 1.0})
    assert load_arrays(tmp_path / "new" / "folder" / "a.npz", "s/1")["x"] == 1.0
    (tmp_path / "file").touch()
    for path in (tmp_path / "file" / "a.npz", tmp_path / "new"):  # below a file; and in a folder's place
        with pytest.raises(InputError, match="choose a place that you may write to"):
            save_arrays(path, "s/1", {"x": 1.0})
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "new"]


def test_objects_are_neither_written_nor_read(tmp_path):
    with pytest.raises(ValueError, match="allow_pickle"):
        save_arrays(tmp_path / "a.npz", "s/1", {"x": np.array([{}], dtype=object)})
    assert not list(tmp_path.iterdir())
    np.savez(tmp_path / "b.npz", x=np.array([{}], dtype=object))
    (tmp_path / "c.npz").write_bytes(pickle.dumps({"x": 1}))
    for name in ("b.npz", "c.npz"):
        with pytest.raises(InputError, match="not a readable"):
            open_arrays(tmp_path / name)


def test_truncated_file_is_refused(tmp_path):
    save_arrays(tmp_path / "a.npz", "s/1", {"x": np.arange(1000.0)})
    whole = (tmp_path / "a.npz").read_bytes()
    for cut in (10, len(whole) // 2, len(whole) - 5):
        (tmp_path / "cut.npz").write_bytes(whole[:cut])
        with pytest.raises(InputError, match="not a readable"):
            open_arrays(tmp_path / "cut.npz")


def test_damaged_contents_are_refused(tmp_path):
    save_arrays(tmp_path / "a.npz", "s/1", {"x": np.random.default_rng(0).normal(size=1000)})
    damaged = bytearray((tmp_path / "a.npz").read_bytes())
    damaged[len(damaged) // 2] ^= 0xFF
    (tmp_path / "bad.npz").write_bytes(damaged)
    with pytest.raises(InputError, match="not a readable"):
        open_arrays(tmp_path / "bad.npz")


def test_npy_and_missing_files_are_named(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros(3))
    with pytest.raises(InputError, match="a single array"):
        open_arrays(tmp_path / "a.npy")
    with pytest.raises(InputError, match="no such file"):
        open_arrays(tmp_path / "gone.npz")
