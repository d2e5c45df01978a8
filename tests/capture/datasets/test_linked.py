"""Recordings that name other files of their data set: found through symbolic links, and nowhere outside it."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from mjx_hand.capture.dataset_files.dataset_root import beside
from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from tests.capture.datasets import test_dexycb, test_grab, test_hocap
from tests.capture.datasets.subjects import licensed_file, licensed_hand


def grab(root: Path) -> Path:
    hand = licensed_hand()
    test_grab.write_mesh(root, hand.template * np.float32(1.2))
    return test_grab.write(root)


def linked(root: Path, recording: Path, tmp_path: Path) -> dict[str, Path]:
    """The recording by several paths."""
    relative = recording.relative_to(root)
    where = tmp_path / "links"
    where.mkdir()
    (where / "root").symlink_to(root)
    (where / "above").symlink_to(root.parent)
    (where / "group").symlink_to(recording.parent)
    (where / "one").symlink_to(recording)
    (where / "two").symlink_to("one")  # a link to a link, relative
    layout = where / "layout"
    layout.mkdir()
    for part in root.iterdir():
        (layout / part.name).symlink_to(part)  # a root of links
    paths = {
        "its own": recording,
        "a linked root": where / "root" / relative,
        "a linked folder above": where / "above" / root.name / relative,
        "a linked group": where / "group" / recording.name,
        "a linked recording": where / "one",
        "two links": where / "two",
        "a root of links": layout / relative,
    }
    return paths | {"relative": Path(os.path.relpath(recording))}


@pytest.mark.parametrize("dataset", ["grab", "dexycb", "hocap"])
def test_a_recording_is_the_same_by_every_path(tmp_path, monkeypatch, dataset):
    monkeypatch.setattr("mjx_hand.capture.datasets.grab.MANO_VERTICES", licensed_hand().num_vertices)
    root = tmp_path / "disk" / "DATA"
    root.mkdir(parents=True)
    monkeypatch.chdir(root)
    writer = {"grab": grab, "dexycb": test_dexycb.write, "hocap": lambda r: test_hocap.write(r, sides=["right"])}
    recording = writer[dataset](root)
    mano = licensed_file(tmp_path)
    expected = load_motion(recording, mano=mano).link_offset
    assert expected is not None
    for name, path in linked(root, recording, tmp_path).items():
        found = load_motion(path, mano=mano).link_offset
        np.testing.assert_array_equal(found, expected, err_msg=name)


def test_a_disk_of_its_own_for_one_folder(tmp_path):
    """The group is a link inside the root to another disk's folder: what is beside the link counts too."""
    root = tmp_path / "DATA"
    recording = test_hocap.write(root, sides=["right"])
    other = tmp_path / "other"
    shutil.move(recording.parent, other)
    recording.parent.symlink_to(other)
    (tmp_path / "way").symlink_to(recording.parent)
    mano = licensed_file(tmp_path)
    for path in (recording, tmp_path / "way" / recording.name):
        assert load_motion(path, mano=mano).link_offset is not None


def test_links_in_a_circle_end(tmp_path):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises((OSError, RuntimeError)):
        (tmp_path / "a").resolve(strict=True)
    assert not beside(tmp_path / "a" / "x", 1, "y").exists()


OUT = [
    "x/../../../outside",
    "..",
    "../outside",
    "/abs",
    "a\\b",
    "",
    "a\0b",
    "n" * 300,
    True,
    None,
    1.5,
    ["a"],
    {"a": 1},
]


@pytest.mark.parametrize("name", OUT)
def test_settings_name_nothing_outside_the_data_set(tmp_path, name):
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "mano.yml").write_text(yaml.safe_dump({"betas": [0.0] * 10}))
    mano = licensed_file(tmp_path)
    cases = [
        (test_dexycb.write(tmp_path / "a" / "ycb", mano_calib=[name]), {}),
        (test_dexycb.write(tmp_path / "b" / "ycb", extrinsics=name), {}),
        (test_hocap.write(tmp_path / "c" / "cap", sides=["right"], subject_id=name), {}),
    ]
    for folder, options in cases:
        with pytest.raises(InputError, match=r"expected|names no subject") as caught:
            load_motion(folder, mano=mano, **options)
        assert len(str(caught.value).replace(str(tmp_path), "")) < 300


def test_a_mesh_outside_the_data_set_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr("mjx_hand.capture.datasets.grab.MANO_VERTICES", licensed_hand().num_vertices)
    grab(tmp_path / "outside")
    for named in ("../../outside/" + test_grab.MESH, str(tmp_path / "outside" / test_grab.MESH), "a\nb.ply", 3, None):
        root = tmp_path / f"root{len(str(named))}" / "GRAB"
        recording = test_grab.write(root)
        contents = dict(np.load(recording, allow_pickle=True))
        contents["rhand"][()]["vtemp"] = named
        np.savez(recording, **contents)
        assert "mean bones" in load_motion(recording, mano=licensed_file(tmp_path)).source
