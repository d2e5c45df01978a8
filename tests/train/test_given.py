"""`data.folder=PATH`: training, evaluation and play on finished demonstrations, whoever made them."""

import dataclasses
import shutil
from pathlib import Path

import numpy as np
import pytest

import train.ppo
from envs.demonstrations.dataset import make_missing_sets
from envs.demonstrations.set_settings import SetSettings, set_folder
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import load_demonstration, save_demonstration
from mjx_hand.pytree import replace
from train.experiment.evaluate_seeds import POLICY, evaluate_seeds
from train.experiment.setup import load_env
from train.play import viewer
from train.reports.evaluation_record import evaluation_fingerprint
from train.settings.config import Config, compose
from train.settings.options import Play


@pytest.fixture(scope="module")
def given(tiny: Config, tmp_path_factory: pytest.TempPathFactory) -> Config:
    """The tiny set's demonstrations, of a grasp that the project does not know, in a folder of somebody's own."""
    folder = tmp_path_factory.mktemp("mine")
    for part in ("train", "heldout"):
        (folder / part).mkdir()
        made = load_demonstration(set_folder(tiny.data, tiny.demonstrations) / part / "000.npz")
        save_demonstration(replace(made, grasp="my own"), folder / part / "000.npz")
    return dataclasses.replace(
        tiny,
        name="given",
        data=SetSettings("given", folder=str(folder)),
        demonstrations=str(folder / "no set is looked for"),
        task=dataclasses.replace(tiny.task, grip_force=2.0),
        out=str(tmp_path_factory.mktemp("out")),
    )


@pytest.mark.slow
def test_a_policy_is_trained_evaluated_and_played(given: Config):
    points = train.ppo.train(given)
    assert [point.steps for point in points] == [0, 32, 64]
    assert load_env(given, "train").demonstrations[0].grasp == "my own"
    (results,) = evaluate_seeds([given]).values()
    assert np.isfinite(results.evaluations[POLICY].scores["tracking_error_cm"]).all()
    shown = viewer(dataclasses.replace(given, play=Play(port=0)))
    assert shown.scene.title.startswith("given 0: ")
    shown.close()
    assert not Path(given.demonstrations).exists()


def test_a_training_goes_on_with_the_same_demonstrations_wherever_they_are(given: Config, tmp_path: Path):
    config = dataclasses.replace(given, out=str(tmp_path / "out"))
    short = dataclasses.replace(config, ppo=dataclasses.replace(config.ppo, num_timesteps=32))
    train.ppo.train(short)
    moved = tmp_path / "moved"
    shutil.copytree(given.data.folder, moved)
    there = dataclasses.replace(short, data=SetSettings("given", folder=str(moved)))
    assert evaluation_fingerprint([there]) == evaluation_fingerprint([short])
    assert [point.steps for point in train.ppo.train(there)] == [0, 32]
    shutil.copy(moved / "heldout" / "000.npz", moved / "train" / "000.npz")
    assert evaluation_fingerprint([there]) != evaluation_fingerprint([short])
    with pytest.raises(InputError, match=r"holds a training with data.contents=\w+, now \w+"):
        train.ppo.train(there)


def test_a_folder_that_holds_nothing_out_says_so(given: Config, tmp_path: Path, capsys):
    shutil.copy(Path(given.data.folder, "train", "000.npz"), tmp_path / "000.npz")
    config = dataclasses.replace(given, data=SetSettings("given", folder=str(tmp_path)))
    load_env(config, "train")
    assert not capsys.readouterr().out
    load_env(config, "heldout")
    assert f"{tmp_path} holds no demonstrations out" in capsys.readouterr().out


def test_a_missing_set_is_made_by_a_step_of_its_own_which_says_so(tiny: Config, tmp_path: Path, monkeypatch, capsys):
    config = dataclasses.replace(tiny, demonstrations=str(tmp_path))
    with pytest.raises(InputError, match=r"not made yet; .*python -m envs.demonstrations config=pinch"):
        load_env(config, "train")
    made = []
    monkeypatch.setattr(
        "envs.demonstrations.dataset.make_set", lambda settings, root, report: made.append((settings, root))
    )
    make_missing_sets(config.data, config.demonstrations)
    assert made == [(tiny.data, str(tmp_path))]
    assert f"{set_folder(tiny.data, tmp_path)} is missing: making the demonstrations" in capsys.readouterr().out
    made.clear()
    make_missing_sets(tiny.data, tiny.demonstrations)
    assert not made
    assert not capsys.readouterr().out


def test_the_command_line_takes_the_folder_alone():
    config = compose(["ppo.num_envs=512", "data.folder=my/demonstrations", "seed=3"])
    assert config.data == SetSettings("given", folder="my/demonstrations")
    assert (config.name, config.out, config.ppo.num_envs) == ("given", "outputs/given/seed3", 512)
    assert compose(["config=given", "data.folder=mine", "name=cups"]).out == "outputs/cups/seed0"


@pytest.mark.parametrize("override", ["config=pinch", "data.grasp=power", "data.people=2", "data.capture.method=paper"])
def test_what_contradicts_the_folder_is_named(override: str):
    with pytest.raises(InputError, match=rf"{override} beside data.folder: .*leave out one of the two"):
        compose([override, "data.folder=mine"])


def test_no_folder_is_refused():
    with pytest.raises(InputError, match=r"data.folder ''; give data.folder=PATH alone"):
        compose(["config=given"])
