import csv
import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from omegaconf import OmegaConf

import train.ppo
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from train.experiment.evaluate_seeds import POLICY, ZERO, evaluate_checkpoint
from train.experiment.setup import chosen_checkpoint
from train.learning.checkpoint import load_checkpoint, save_checkpoint
from train.learning.curve import Point
from train.learning.learner import Learner
from train.settings.config import Config, compose
from train.settings.options import Checks

Trained = tuple[Path, list[Point]]


def arrays(path: Path) -> dict[str, np.ndarray]:
    with np.load(path, allow_pickle=False) as file:
        return dict(file)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def in_folder(config: Config, out: Path, **change: Any) -> Config:
    return dataclasses.replace(config, out=str(out), **change)


def test_evaluations_come_before_learning_and_every_so_many_steps(trained: Trained):
    _, points = trained
    assert [point.steps for point in points] == [0, 32, 64]
    assert np.all(np.diff([point.seconds for point in points]) > 0)
    assert all(np.isfinite(dataclasses.astuple(point)).all() for point in points)


def test_the_curve_is_what_was_returned(trained: Trained):
    out, points = trained
    written = rows(out / "curve.csv")
    assert list(written[0]) == [field.name for field in dataclasses.fields(Point)]
    np.testing.assert_allclose(
        [[float(value) for value in row.values()] for row in written], [dataclasses.astuple(p) for p in points], 1e-4
    )


def test_the_folder_holds_what_it_takes_to_go_on(trained: Trained, tiny: Config):
    out, _ = trained
    assert {path.name for path in out.iterdir()} >= {
        "best.npz",
        "config.yaml",
        "curve.csv",
        "last.npz",
        "state",
        "tensorboard",
    }
    assert not list(out.rglob(".*")), "a temporary file was left behind"
    (events,) = (out / "tensorboard").iterdir()
    assert b"evaluation/tracking_error_cm" in events.read_bytes()
    written = OmegaConf.load(out / "config.yaml")
    assert written == OmegaConf.create(json.loads(json.dumps(dataclasses.asdict(tiny))))


def test_checkpoints_say_where_they_come_from(trained: Trained, env: TrackingEnv):
    out, points = trained
    last, best = load_checkpoint(out / "last.npz"), load_checkpoint(out / "best.npz")
    assert (last.steps, last.experiment, last.observation_size) == (64, "tiny", env.observation_size)
    chosen = min(points, key=lambda point: (-point.success, point.tracking_error_cm))
    assert (best.steps, best.success) == (chosen.steps, chosen.success)


def test_learning_changes_every_layer(trained: Trained, tiny: Config, env: TrackingEnv, tmp_path):
    out, _ = trained
    stopped = train.ppo.train(in_folder(tiny, tmp_path, checks=Checks(every=32, stop_at=0.0)), env)
    assert [point.steps for point in stopped] == [0], "stop_at was reached before any learning"
    before, after = arrays(tmp_path / "last.npz"), arrays(out / "last.npz")
    layers = [name for name in after if name.startswith(("policy/", "value/"))]
    assert len(layers) >= 9
    for name in layers:
        assert before[name].shape == after[name].shape
        assert np.isfinite(after[name]).all()
        assert not np.array_equal(before[name], after[name]), f"{name} did not change"
    assert len(rows(tmp_path / "curve.csv")) == 1


def test_a_training_that_is_watched_can_be_ended_and_goes_on(
    trained: Trained, tiny: Config, env: TrackingEnv, tmp_path
):
    out, _ = trained
    seen: list[tuple[int, int, float]] = []

    def enough(points: Sequence[Point], evaluating: float) -> bool:
        seen.append((len(points), points[-1].steps, evaluating))
        return True

    stopped = train.ppo.train(in_folder(tiny, tmp_path), env, enough)
    assert [point.steps for point in stopped] == [0, 32]  # an update is 32 steps, after which it is asked
    ((count, steps, evaluating),) = seen
    assert (count, steps) == (2, 32)
    assert 0 < evaluating < stopped[-1].seconds
    train.ppo.train(in_folder(tiny, tmp_path), env)
    first, second = arrays(out / "last.npz"), arrays(tmp_path / "last.npz")
    for key in first:
        np.testing.assert_array_equal(second[key], first[key])


def test_the_same_seed_gives_the_same_policy_bit_for_bit(trained: Trained, tiny: Config, env: TrackingEnv, tmp_path):
    out, points = trained
    again = train.ppo.train(in_folder(tiny, tmp_path), env)
    assert [(p.steps, p.success, p.tracking_error_cm, p.rotation_error_deg) for p in again] == [
        (p.steps, p.success, p.tracking_error_cm, p.rotation_error_deg) for p in points
    ]
    for name in ("best.npz", "last.npz"):
        first, second = arrays(out / name), arrays(tmp_path / name)
        assert first.keys() == second.keys()
        for key in first:
            np.testing.assert_array_equal(second[key], first[key])


def test_a_folder_that_cannot_be_written_is_refused_before_any_work(tiny: Config, tmp_path):
    (tmp_path / "file").touch()
    nowhere = in_folder(tiny, tmp_path / "file" / "out", demonstrations=str(tmp_path / "none"))
    with pytest.raises(InputError, match=r"cannot write .*file/out: .*; choose another folder with out=FOLDER"):
        train.ppo.train(nowhere)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_checkpoint_of_another_task_is_refused(trained: Trained, tiny: Config, env: TrackingEnv, tmp_path):
    out, _ = trained
    size = env.observation_size
    other = dataclasses.replace(load_checkpoint(out / "best.npz"), observation_size=size + 1)
    save_checkpoint(other, tmp_path / "other.npz")
    with pytest.raises(InputError, match=f"reads {size + 1} observations, this task gives {size}; use the task"):
        chosen_checkpoint(dataclasses.replace(tiny, checkpoint=str(tmp_path / "other.npz")), size)
    with pytest.raises(InputError, match="no such checkpoint; train one first"):
        chosen_checkpoint(in_folder(tiny, tmp_path), size)
    assert chosen_checkpoint(tiny, size).steps == load_checkpoint(out / "best.npz").steps


@pytest.mark.slow
def test_a_short_training_beats_the_zero_residual(tmp_path):
    """Held-out people and objects, which training has not seen."""
    folders = [f"out={tmp_path / 'out'}", f"demonstrations={tmp_path / 'demonstrations'}"]
    few = ["data.people=4", "data.heldout_people=4", "ppo.num_timesteps=300000", "checks.stop_at=0.95"]
    config = compose(["config=pinch_demo", "engine=native", *folders, *few])
    train.ppo.train(config)
    evaluations = evaluate_checkpoint(config).evaluations
    policy, zero = evaluations[POLICY].rows(), evaluations[ZERO].rows()
    assert policy["manip_trans_object"] >= zero["manip_trans_object"] + 0.25
    assert policy["tracking_error_cm"] < 0.7 * zero["tracking_error_cm"]


def test_an_update_has_ended_before_anything_else_runs(tiny: Config, env: TrackingEnv, tmp_path, monkeypatch):
    class Running:
        """Part of what an update returns; it stands for a device at work until someone waits for it."""

        def block_until_ready(self) -> None:
            seen.append("end of an update")

        def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
            return np.zeros((), dtype)

    seen = []
    update, evaluate = Learner.update, train.ppo.evaluate_in

    def begun(self: Learner, *args: Any) -> tuple[Any, Any]:
        seen.append("update")
        state, metrics = update(self, *args)
        return state, {**metrics, "running": Running()}

    def evaluated(*args: Any) -> Any:
        seen.append("evaluation")
        return evaluate(*args)

    monkeypatch.setattr(Learner, "update", begun)
    monkeypatch.setattr(train.ppo, "evaluate_in", evaluated)
    train.ppo.train(in_folder(tiny, tmp_path), env)
    one = ["update", "end of an update"]
    assert seen == [*one, "evaluation", "evaluation", *one, "evaluation"]
