"""`envs.load`: an environment by the name of a grasp type, or over a folder of finished demonstrations."""

import shutil
from pathlib import Path

import jax
import numpy as np
import pytest

import envs
from envs.demonstrations.load_set import demonstration_files, part_digest
from envs.demonstrations.set_settings import SetSettings, set_folder
from mjx_hand.errors import InputError


def test_a_folder_with_parts_steps(set_path: Path):
    env = envs.load(folder=set_path, part="heldout", engine="native", task=envs.Task(lookahead=(2,)))
    (demonstration,) = env.demonstrations
    assert demonstration.grasp == "pinch"
    assert env.task.lookahead == (2,)
    assert len(env.hands) == env.num_demonstrations == 1
    state = jax.jit(env.step)(env.reset(jax.random.key(0)), jax.numpy.zeros(26))
    assert np.isfinite(state.obs).all()


def test_a_type_is_read_from_its_set_and_never_made(set_path: Path, tmp_path: Path):
    with pytest.raises(InputError, match=r"pinch-.* is not made yet; .*python -m envs.demonstrations config=pinch"):
        envs.load("pinch", root=tmp_path)
    assert not list(tmp_path.iterdir())
    shutil.copytree(set_path, set_folder(SetSettings("pinch"), tmp_path))
    assert envs.load("pinch", engine="native", root=tmp_path).num_demonstrations == 2


def test_a_folder_without_parts_is_both(set_path: Path, tmp_path: Path):
    shutil.copy(set_path / "train" / "001.npz", tmp_path / "000.npz")
    (tmp_path / "000.motion.npz").touch()  # what stands beside demonstrations is none
    for part in ("train", "heldout"):
        assert demonstration_files(tmp_path, part) == [tmp_path / "000.npz"]
    assert envs.load(folder=tmp_path, engine="native").num_demonstrations == 1


def test_what_cannot_be_loaded_is_said(tmp_path: Path):
    with pytest.raises(InputError, match="nowhere: no such folder"):
        envs.load(folder=tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"no train demonstrations; valid are train/NNN.npz and heldout/NNN.npz, or"):
        envs.load(folder=tmp_path)
    with pytest.raises(InputError, match="part 'test' is not known; valid: train, heldout"):
        envs.load(folder=tmp_path, part="test")
    for given in ({}, {"grasp": "pinch", "folder": tmp_path}):
        with pytest.raises(InputError, match="give one of them"):
            envs.load(**given)
    (tmp_path / "train").mkdir()
    (tmp_path / "000.npz").write_bytes(b"none")
    with pytest.raises(InputError, match="no train demonstrations"):
        envs.load(folder=tmp_path)


def test_the_digest_is_of_the_contents_and_not_of_the_place(set_path: Path, tmp_path: Path):
    there = tmp_path / "there"
    shutil.copytree(set_path, there)
    assert part_digest(there, "train") == part_digest(set_path, "train")
    assert part_digest(there, "train") != part_digest(there, "heldout")
    shutil.copy(there / "train" / "000.npz", there / "train" / "001.npz")
    assert part_digest(there, "train") != part_digest(set_path, "train")


def test_a_folder_and_a_type_contradict_each_other():
    for grasp, folder in (("pinch", "somewhere"), ("given", "")):
        with pytest.raises(InputError, match=r"data.grasp is .* and data.folder .*; give data.folder=PATH alone"):
            SetSettings(grasp, folder=folder)
