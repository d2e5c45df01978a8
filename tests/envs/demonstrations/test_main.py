import dataclasses
import json

import numpy as np
import pytest
from PIL import Image

from envs.demonstrations import set_settings
from envs.demonstrations.__main__ import main, settings_of
from envs.demonstrations.dataset import YIELD
from envs.demonstrations.load_set import PARTS
from envs.demonstrations.quality import check_part
from envs.demonstrations.scripted.simulated_capture import load_truth, save_truth
from envs.demonstrations.set_settings import SetSettings, set_folder
from envs.grasps import grasp_type
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import load_demonstration, save_demonstration
from tests.envs.conftest import SETTINGS

ARGUMENTS = [
    "config=pinch",
    "data.people=2",
    "data.heldout_people=1",
    "data.trials=1",
    "data.heldout_trials=1",
    "data.seed=3",
]


def test_a_set_is_shown(set_path, set_root, capsys):
    killed = set_path / ".sheet.png-abcdefgh"
    killed.mkdir()
    main([*ARGUMENTS, f"demonstrations={set_root}"])
    said = capsys.readouterr().out
    tallies = json.loads((set_path / YIELD).read_text())
    cells = [line.replace("│", " ").split() for line in said.splitlines()]
    assert ["attempts", *(str(sum(tallies[part].values())) for part in PARTS)] in cells
    for words in ("attempts", "held", "hinges from the truth", str(set_path / "sheet.png")):
        assert words in said
    assert not killed.exists()
    picture = np.asarray(Image.open(set_path / "sheet.png"), float)
    assert picture.shape == (2 * 240, 6 * 240, 3)
    frames = picture.reshape(2, 240, 6, 240, 3)
    assert frames.std(axis=(1, 3)).min() > 5  # no cell is empty
    assert np.abs(np.diff(frames, axis=2)).mean(axis=(1, 3, 4)).min() > 1  # each moment differs from the one before


def test_settings_come_from_the_experiment_and_its_overrides():
    assert settings_of(ARGUMENTS)[0] == SETTINGS
    settings, root = settings_of(["config=power", "data.capture.fps=100", "demonstrations=here"])
    assert settings == SetSettings("power", capture=dataclasses.replace(SETTINGS.capture, fps=100.0))
    assert str(root) == "here"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], r"config is ''; give config=NAME, one of .*pinch.*power"),
        (["config=fist"], "config is 'fist'"),
        (["config=pinch", "seed=3"], "'seed' is not an option; valid: config, demonstrations, part=sealed, data"),
        (["config=pinch", "data.persons=3"], "Key 'persons' not in 'SetSettings'"),
        (["config=pinch", "data.people=many"], "'many'.*could not be converted"),
        (["config=pinch", "data.people=0"], "data.people is 0"),
    ],
)
def test_bad_arguments_are_refused_in_one_line(arguments, words):
    with pytest.raises(InputError, match=words) as caught:
        settings_of(arguments)
    assert "\n" not in str(caught.value)


def test_a_changed_grasp_type_is_another_set(monkeypatch, tmp_path):
    heavier = dataclasses.replace(grasp_type("pinch"), object_mass=(0.3, 0.4))
    before = set_folder(SETTINGS, tmp_path)
    monkeypatch.setattr(set_settings, "grasp_type", lambda name: heavier)
    assert set_folder(SETTINGS, tmp_path) != before


def test_a_demonstration_that_is_not_what_happened_is_found(set_path, tmp_path):
    (tmp_path / "train").mkdir()
    d = load_demonstration(set_path / "train" / "000.npz")
    truth = load_truth(set_path / "train" / "000.truth.npz")
    save_truth(truth, tmp_path / "train" / "000.truth.npz")
    save_demonstration(d, tmp_path / "train" / "000.npz")
    assert check_part(tmp_path, "train").lift[0] > 0.1
    save_demonstration(dataclasses.replace(d, object_pose=d.object_pose + 0.01), tmp_path / "train" / "000.npz")
    with pytest.raises(InputError, match="demonstration 0 shows its object more than 10 mm from where it was"):
        check_part(tmp_path, "train")
    low = truth.object_pose.copy()
    low[:, 2] = low[0, 2]
    save_truth(dataclasses.replace(truth, object_pose=low), tmp_path / "train" / "000.truth.npz")
    with pytest.raises(InputError, match=r"demonstration 0 lifts its object by less than 9\.5 cm"):
        check_part(tmp_path, "train")
