"""`config=all`: one policy on the demonstrations of every grasp type."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import train.ppo
from envs.demonstrations import load_set
from envs.demonstrations.load_set import load_part
from envs.demonstrations.set_settings import SetSettings, set_folder
from envs.grasps import FIVE, grasp_names, grasp_type
from envs.reference import make_reference
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from mjx_hand.pytree import replace
from mjx_hand.view.browser.viewer import Viewer
from train.evaluate import evaluate_and_write
from train.experiment.evaluate_seeds import BASELINES, POLICY
from train.experiment.setup import load_env, without_grip
from train.play import viewer
from train.reports.evaluation_record import evaluation_fingerprint
from train.settings.config import Config, compose
from train.settings.options import Play
from train.view import video


def test_it_uses_the_very_sets_of_the_single_types(tmp_path):
    everything = compose(["config=all", "data.people=2"]).data.expand_types()
    assert [settings.grasp for settings in everything] == sorted(FIVE)
    for settings in everything:
        alone = compose([f"config={settings.grasp}", "data.people=2"]).data
        assert set_folder(settings, tmp_path) == set_folder(alone, tmp_path)
    assert compose(["config=pinch"]).data.expand_types() == (compose(["config=pinch"]).data,)


def test_the_force_of_a_grip_makes_no_other_demonstrations_and_another_evaluation(monkeypatch, tiny: Config):
    folder, digest = set_folder(tiny.data, "sets"), evaluation_fingerprint([tiny])
    harder = dataclasses.replace(grasp_type("pinch"), grip_force=99.0)
    for module in ("envs.demonstrations.set_settings", "train.reports.evaluation_record"):
        monkeypatch.setattr(f"{module}.grasp_type", lambda name: harder if name == "pinch" else grasp_type(name))
    assert set_folder(tiny.data, "sets") == folder
    assert evaluation_fingerprint([tiny]) != digest


@pytest.fixture(scope="module")
def everything(tiny: Config) -> Config:
    return dataclasses.replace(tiny, data=dataclasses.replace(tiny.data, grasp="all"))


def test_the_types_stand_one_after_the_other(monkeypatch, tiny: Config, everything: Config):
    """With the pinch's set in place of all others, each held as its own type would be."""
    folder = set_folder(tiny.data, tiny.demonstrations)
    asked: list[SetSettings] = []

    def part_of_type(path: Path, part: str):
        assert path == folder
        return [replace(d, grasp=asked[-1].grasp) for d in load_part(path, part)]

    monkeypatch.setattr(load_set, "set_folder", lambda settings, root: asked.append(settings) or folder)
    monkeypatch.setattr(load_set, "load_part", part_of_type)
    env = load_env(everything, "train")
    assert asked == [dataclasses.replace(tiny.data, grasp=name) for name in sorted(FIVE)]
    assert [d.grasp for d in env.demonstrations] == sorted(FIVE)
    grip, forces = np.asarray(env.reference.grip), [grasp_type(name).grip_force for name in sorted(FIVE)]
    for row, force in zip(grip, forces, strict=True):
        assert np.allclose(row, grip[0]) == (force == forces[0])
    assert not np.asarray(without_grip(env).reference.grip).any()
    bare = make_reference(env.demonstrations, env.hands, grip_force=0.0, gains=env.gains)
    np.testing.assert_allclose(without_grip(env).reference.controls, bare.controls, atol=1e-6)


def test_one_set_is_never_of_all_types(everything: Config, tmp_path):
    with pytest.raises(InputError, match=f"'all' is not known; valid: {', '.join(grasp_names())}"):
        set_folder(everything.data, tmp_path)


@pytest.mark.slow
def test_all_types_are_made_trained_evaluated_and_played(everything: Config, tmp_path, monkeypatch):
    config = dataclasses.replace(everything, out=str(tmp_path / "out"), play=Play(port=0))
    env: TrackingEnv = load_env(config, "train")
    kinds = {d.object.kind for d in env.demonstrations}
    assert kinds == {grasp_type(name).object_kind for name in sorted(FIVE)}
    points = train.ppo.train(config, env)
    assert points[-1].steps >= config.ppo.timesteps

    monkeypatch.setattr(video, "side_by_side", lambda env, rollouts, index, path: Path(path).write_bytes(b"film"))
    folder, (_, _, by_type) = evaluate_and_write([config])
    assert [row[0] for row in by_type.rows] == [*sorted(FIVE), "mean over the types"]
    assert list(by_type.columns) == ["", POLICY, *BASELINES, "paper, its own count"]
    summary = json.loads((folder / "evaluation.json").read_text())
    for title in (POLICY, *BASELINES):
        every = summary["types"][title]
        assert list(every) == sorted(FIVE)
        mean = np.mean([scores["tracking_error_cm"] for scores in every.values()])
        assert summary["scores"][title]["tracking_error_cm"] == pytest.approx(mean)  # one demonstration a type
    assert "Every grasp type" in (folder / "evaluation.html").read_text()

    shown: Viewer = viewer(dataclasses.replace(config, play=Play(demonstration=4, port=0)))
    assert shown.scene.title.startswith("tiny 4")
    shown.close()
