import dataclasses
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import save_arrays
from train.learning.checkpoint import SCHEMA, Checkpoint, is_saved, load_checkpoint, save_checkpoint

RNG = np.random.default_rng(0)


def layer(inputs: int, outputs: int) -> dict[str, Any]:
    return {
        "kernel": RNG.normal(size=(inputs, outputs)).astype(np.float32),
        "bias": RNG.normal(size=outputs).astype(np.float32),
    }


def a_checkpoint(**change: Any) -> Checkpoint:
    made = Checkpoint(
        policy={"params": {"hidden_0": layer(7, 4), "hidden_1": layer(4, 3), "LogParam_0": {"log_value": np.zeros(3)}}},
        value={"params": {"hidden_0": layer(7, 1)}},
        steps=1234,
        success=0.1 + 0.2,  # a number that decimal text would shorten
        experiment="pinch",
        observation_size=7,
    )
    return dataclasses.replace(made, **change)


def leaves(tree: Mapping[str, Any], prefix: str = "") -> dict[str, np.ndarray]:
    found = {}
    for key, value in tree.items():
        name = f"{prefix}/{key}"
        found |= leaves(value, name) if isinstance(value, Mapping) else {name: np.asarray(value)}
    return found


@pytest.fixture
def path(tmp_path: Path) -> Path:
    save_checkpoint(a_checkpoint(), tmp_path / "best.npz")
    return tmp_path / "best.npz"


def test_what_is_saved_comes_back_exactly(tmp_path):
    saved = a_checkpoint()
    save_checkpoint(saved, tmp_path / "a.npz")
    back = load_checkpoint(tmp_path / "a.npz")
    for part in ("policy", "value"):
        before, after = leaves(getattr(saved, part)), leaves(getattr(back, part))
        assert before.keys() == after.keys()
        for name in before:
            np.testing.assert_array_equal(after[name], before[name], strict=name != "/params/LogParam_0/log_value")
    scalars = ("steps", "success", "experiment", "observation_size")
    assert [getattr(back, n) for n in scalars] == [getattr(saved, n) for n in scalars]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("steps", np.zeros(3)),
        ("steps", np.array("many")),
        ("observation_size", np.array(np.nan)),
        ("experiment", np.array(3)),
        ("experiment", np.array(["a", "b"])),
        ("settings", np.array("{")),
        ("settings", np.array("[" * 100_000)),
        ("settings", np.array("[1]")),
        ("policy/params", np.zeros(2)),
        ("policy/params/hidden_0/kernel", np.array("text")),
        ("policy/params/hidden_0/kernel/below", np.zeros(2)),
    ],
)
def test_members_of_other_kinds_are_refused(path, name, value):
    with np.load(path) as file:
        arrays = dict(file)
    np.savez(path, **(arrays | {name: value}))
    with pytest.raises(InputError):
        load_checkpoint(path)


def test_whether_a_file_holds_a_checkpoint_already(path):
    kept = a_checkpoint()
    assert not is_saved(kept, path), "its numbers are drawn anew"
    save_checkpoint(kept, path)
    assert is_saved(kept, path)
    assert not is_saved(dataclasses.replace(kept, steps=1), path)
    path.write_bytes(path.read_bytes()[:-1])
    assert not is_saved(kept, path)


def test_success_that_was_not_evaluated_stays_nan(tmp_path):
    save_checkpoint(a_checkpoint(success=float("nan")), tmp_path / "a.npz")
    assert np.isnan(load_checkpoint(tmp_path / "a.npz").success)


def test_the_file_names_its_arrays_and_needs_no_pickle(path):
    with np.load(path, allow_pickle=False) as file:
        assert str(file["schema"]) == SCHEMA
        assert file["policy/params/hidden_0/kernel"].shape == (7, 4)
        assert not any(file[name].dtype.hasobject for name in file.files)


def test_names_that_cannot_be_told_apart_are_refused(tmp_path):
    with pytest.raises(ValueError, match="slash"):
        save_checkpoint(a_checkpoint(policy={"a/b": np.zeros(1)}), tmp_path / "a.npz")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_file_says_how_to_get_one(tmp_path):
    with pytest.raises(InputError, match=r"gone\.npz: no such checkpoint; train one first"):
        load_checkpoint(tmp_path / "gone.npz")
    with pytest.raises(InputError, match="no such checkpoint"):
        load_checkpoint(tmp_path)


def test_files_of_another_kind_are_refused(tmp_path):
    save_arrays(tmp_path / "motion.npz", "mjx-hand/motion/1", {"a": np.zeros(3)})
    with pytest.raises(InputError, match=r"schema mjx-hand/motion/1, expected mjx-hand/policy/1"):
        load_checkpoint(tmp_path / "motion.npz")
    save_arrays(tmp_path / "future.npz", "mjx-hand/policy/2", {"a": np.zeros(3)})
    with pytest.raises(InputError, match="schema mjx-hand/policy/2"):
        load_checkpoint(tmp_path / "future.npz")
    (tmp_path / "text.npz").write_text("not a checkpoint")
    with pytest.raises(InputError, match=r"text\.npz"):
        load_checkpoint(tmp_path / "text.npz")


def test_a_file_that_lacks_something_says_what(tmp_path):
    save_arrays(tmp_path / "a.npz", SCHEMA, {"steps": 1, "success": 0.5, "experiment": "pinch"})
    with pytest.raises(InputError, match="has no 'observation_size'"):
        load_checkpoint(tmp_path / "a.npz")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_cut_off_files_are_refused_in_one_line(path, share):
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError) as caught:
        load_checkpoint(path)
    assert "\n" not in str(caught.value)


def test_flipped_bits_are_noticed(path):
    with zipfile.ZipFile(path) as file:
        entry = file.getinfo("policy/params/hidden_0/kernel.npy")
    data = bytearray(path.read_bytes())
    data[entry.header_offset + 30 + len(entry.filename) + 60] ^= 0xFF
    path.write_bytes(bytes(data))
    with pytest.raises(InputError):
        load_checkpoint(path)


def test_a_save_that_fails_leaves_the_old_file(path, monkeypatch):
    before = path.read_bytes()

    def full_disk(file: Any, **arrays: Any) -> None:
        file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full_disk)
    with pytest.raises(InputError, match="No space left"):
        save_checkpoint(a_checkpoint(steps=9999), path)
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == [path.name]
