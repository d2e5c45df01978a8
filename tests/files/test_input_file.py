"""What is no file, or not the file itself, is told before anything is opened."""

import os

import pytest

from mjx_hand.errors import InputError
from mjx_hand.files.input_file import check_input_file


def told(path) -> str:
    with pytest.raises(InputError) as caught:
        check_input_file(path, "give a recording")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400
    return str(caught.value)


def test_what_is_no_file(tmp_path):
    assert "no such file; give a recording" in told(tmp_path / "absent.npz")
    assert "a folder; give a recording" in told(tmp_path)
    assert "File name too long" in told(tmp_path / ("x" * 300))
    os.mkfifo(tmp_path / "pipe.urdf")  # opening it would wait for ever
    assert "a pipe or a device" in told(tmp_path / "pipe.urdf")
    (tmp_path / "empty.npz").touch()
    assert "the file is empty" in told(tmp_path / "empty.npz")
    (tmp_path / "in.npz").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n")
    assert "a Git LFS pointer, not the file itself; run 'git lfs pull'" in told(tmp_path / "in.npz")
    (tmp_path / "sound.npz").write_bytes(b"PK")
    check_input_file(tmp_path / "sound.npz", "give a recording")
