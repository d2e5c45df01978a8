import dataclasses
import json

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations import dataset
from envs.demonstrations.dataset import make_sealed, make_set
from envs.demonstrations.load_set import PARTS, load_demonstrations, load_part
from envs.demonstrations.scripted.simulated_capture import CaptureSettings, load_truth
from envs.demonstrations.set_settings import SetSettings, sealed_folder, seed_of_sealed, set_folder
from envs.demonstrations.twin_hands import twins
from envs.grasps import grasp_names
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import load_demonstration, save_demonstration
from mjx_hand.motion.motion import load_motion_file
from tests.envs.conftest import SETTINGS


def assert_same(first, second):
    jax.tree.map(np.testing.assert_array_equal, first, second)
    assert first.source == second.source


def test_a_set_holds_its_parts_and_says_how_it_was_made(set_path):
    counts = {"train": SETTINGS.people * SETTINGS.trials, "heldout": SETTINGS.heldout_people * SETTINGS.heldout_trials}
    for part in PARTS:
        assert len(load_part(set_path, part)) == counts[part]
        names = {p.name for p in (set_path / part).iterdir()}
        assert names == {f"{k:03d}{end}" for k in range(counts[part]) for end in (".npz", ".motion.npz", ".truth.npz")}
    assert json.loads((set_path / "settings.json").read_text()) == json.loads(json.dumps(dataclasses.asdict(SETTINGS)))


def test_demonstrations_come_back_as_they_were_saved(demonstrations, tmp_path):
    save_demonstration(demonstrations[0], tmp_path / "again.npz")
    assert_same(load_demonstration(tmp_path / "again.npz"), demonstrations[0])


def test_a_set_that_is_there_is_not_made_again(set_path, set_root, monkeypatch):
    monkeypatch.setattr(dataset, "_make_part", lambda *args: pytest.fail("made again"))
    assert make_set(SETTINGS, set_root) == set_path


def test_the_folder_tells_settings_apart(tmp_path):
    folders = {
        set_folder(s, tmp_path)
        for s in (
            SETTINGS,
            dataclasses.replace(SETTINGS, seed=4),
            dataclasses.replace(SETTINGS, people=3),
            dataclasses.replace(SETTINGS, capture=CaptureSettings(marker_noise=0.001)),
        )
    }
    assert len(folders) == 4


@pytest.mark.slow
def test_the_same_seed_makes_the_same_set(set_path, tmp_path):
    again = make_set(SETTINGS, tmp_path)
    assert again.name == set_path.name
    for part in PARTS:
        for first, second in zip(load_part(set_path, part), load_part(again, part), strict=True):
            assert_same(first, second)


def test_held_out_people_and_objects_are_others(set_path):
    people = ("train/000", "train/001", "heldout/000")
    first, second, other = (load_truth(set_path / f"{person}.truth.npz").shape for person in people)
    for a, b in ((first, second), (first, other), (second, other)):
        assert np.abs(a - b).max() > 0.1
    sizes = [d.object.size[0] for part in PARTS for d in load_part(set_path, part)]
    assert len(set(sizes)) == len(sizes)


def test_what_was_captured_is_near_the_truth_and_not_the_truth(set_path, demonstrations):
    for k, d in enumerate(demonstrations):
        truth = load_truth(set_path / "train" / f"{k:03d}.truth.npz")
        motion = load_motion_file(set_path / "train" / f"{k:03d}.motion.npz")
        assert truth.angles.shape == d.motion.angles.shape
        assert motion.num_frames == d.num_frames
        np.testing.assert_array_equal(motion.shape, d.shape)
        error = np.abs(truth.angles - d.motion.angles)
        assert 1e-4 < error.mean() < np.deg2rad(6)
        assert np.linalg.norm(truth.wrist_position - d.motion.wrist_position, axis=1).mean() < 0.006
        turned = Rotation.from_quat(truth.wrist_quaternion, scalar_first=True).inv() * Rotation.from_quat(
            d.motion.wrist_quaternion, scalar_first=True
        )
        assert turned.magnitude().mean() < np.deg2rad(6)
        assert np.linalg.norm(truth.object_pose[:, :3] - d.object_pose[:, :3], axis=1).max() < 0.005
        assert truth.shape.shape == d.shape.shape


def test_each_demonstration_lifts_its_object_and_keeps_it(demonstrations):
    for d in demonstrations:
        rise = d.object_pose[:, 2] - d.object_pose[0, 2]
        assert rise.max() > 0.06
        assert rise[-1] > 0.06
        assert d.motion.fps == 50
        np.testing.assert_allclose(np.linalg.norm(d.object_pose[:, 3:], axis=1), 1, atol=1e-6)


def test_a_twin_is_built_from_the_fitted_shape(demonstrations, hands):
    assert len(hands) == len(demonstrations)
    lengths = [np.linalg.norm(hand.link_offset, axis=1).sum() for hand in twins(demonstrations)]
    assert lengths[0] != lengths[1]
    for hand, d in zip(hands, demonstrations, strict=True):
        assert hand.side == d.motion.side


@pytest.mark.parametrize("when", ["train", "heldout"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interrupted_set_leaves_nothing(tmp_path, monkeypatch, when, error):
    def broken(settings, people, seed, folder, part, report):
        folder.mkdir()
        (folder / "000.npz").write_bytes(b"half")
        if part == when:
            raise error

    monkeypatch.setattr(dataset, "_make_part", broken)
    with pytest.raises(error):
        make_set(SETTINGS, tmp_path / "sets")
    assert list((tmp_path / "sets").iterdir()) == []


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(InputError, match="choose a folder that you may write to"):
        make_set(SETTINGS, tmp_path / "file" / "sets")


def test_unknown_and_empty_parts_are_refused(set_path, tmp_path):
    with pytest.raises(InputError, match="part 'test' is not known; valid: train, heldout"):
        load_part(set_path, "test")
    with pytest.raises(InputError, match="no train demonstrations"):
        load_part(tmp_path, "train")


@pytest.mark.parametrize("name", ["people", "trials", "heldout_people", "heldout_trials"])
def test_sets_of_nothing_are_refused(name):
    with pytest.raises(InputError, match=rf"data.{name} is 0; it must be at least 1"):
        dataclasses.replace(SETTINGS, **{name: 0})


def test_an_unknown_grasp_is_refused_before_anything_is_made():
    with pytest.raises(InputError, match="grasp type 'fist' is not known"):
        SetSettings("fist")


def test_the_sealed_part_is_of_other_people_and_stands_apart(set_path, tmp_path):
    settings = dataclasses.replace(SETTINGS, sealed_people=2, sealed_trials=1)
    folder = make_sealed(settings, tmp_path)
    assert folder == sealed_folder(settings, tmp_path) != set_folder(settings, tmp_path)
    assert set_folder(settings, tmp_path).name == set_path.name, "sets are the same whatever is sealed"
    sealed = load_demonstrations(settings, "sealed", tmp_path)
    assert len(sealed) == 2
    shapes = [load_truth(path).shape for path in (*set_path.glob("*/*.truth.npz"), *folder.glob("*/*.truth.npz"))]
    assert len({shape.tobytes() for shape in shapes}) == SETTINGS.people + SETTINGS.heldout_people + 2
    sizes = [d.object.size[0] for d in (*load_part(set_path, "train"), *load_part(set_path, "heldout"), *sealed)]
    assert len(set(sizes)) == len(sizes)
    with pytest.raises(InputError, match=r"config=pinch part=sealed"):
        load_demonstrations(dataclasses.replace(settings, sealed_trials=2), "sealed", tmp_path)
    with pytest.raises(InputError, match="have no sealed part"):
        sealed_folder(SetSettings("given", folder="here"), tmp_path)


def test_every_type_draws_its_sealed_part_by_itself():
    seeds = [(0, 1), (1, 1), (0, 0), (0, 2)]
    settings = [SetSettings(grasp, seed=own, sealed_seed=sealed) for grasp in grasp_names() for own, sealed in seeds]
    assert len({seed_of_sealed(one) for one in settings}) == len(settings)
    assert len({sealed_folder(one, "") for one in settings}) == len(settings)
    assert len({set_folder(one, "") for one in settings}) == 2 * len(grasp_names()), "other parts know nothing of it"
