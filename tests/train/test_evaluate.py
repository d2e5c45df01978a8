"""Two seeds of one tiny experiment, evaluated together: the best and the last policy of one training."""

import csv
import dataclasses
import json
import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from envs.evaluation.failure import FAILURES
from mjx_hand.errors import InputError
from mjx_hand.view.video import video as view_video
from mjx_hand.view.video.renderer import RendererUnavailable
from train import evaluate
from train.evaluate import evaluate_and_write
from train.experiment.evaluate_seeds import (
    BASELINES,
    POLICY,
    PRESS,
    REPLAY,
    ZERO,
    Results,
    evaluate_seeds,
    shared_folder,
)
from train.experiment.setup import chosen_checkpoint, settled
from train.learning.checkpoint import load_checkpoint
from train.learning.curve import Point
from train.reports import evaluation_record
from train.reports.evaluation_page import tables
from train.reports.evaluation_record import cached_results
from train.settings.config import Config, compose
from train.view import video

Trained = tuple[Path, list[Point]]
SEEDS = (4, 7)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def configs(trained: Trained, tiny: Config, tmp_path_factory: pytest.TempPathFactory) -> list[Config]:
    out, _ = trained
    folder = tmp_path_factory.mktemp("seeds")
    made = []
    for seed, policy in zip(SEEDS, ("best", "last"), strict=True):
        (folder / f"seed{seed}").mkdir()
        shutil.copy(out / f"{policy}.npz", folder / f"seed{seed}" / "best.npz")
        made.append(dataclasses.replace(tiny, seed=seed, out=str(folder / f"seed{seed}")))
    return made


@pytest.fixture(scope="module")
def results(configs: list[Config]) -> dict[int, Results]:
    return evaluate_seeds(configs)


@pytest.fixture(scope="module")
def written(results: dict[int, Results], configs: list[Config]) -> Path:
    """Everything that the command writes, with bytes for videos: `test_video` draws some."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(evaluate, "evaluate_seeds", lambda _: results)
        patched.setattr(video, "side_by_side", lambda setup, rollouts, index, path: Path(path).write_bytes(b"film"))
        folder, _ = evaluate_and_write(configs)
    return folder


def test_the_tables_have_the_policy_and_the_baselines(results: dict[int, Results], tiny: Config):
    scores, failures = tables({SEEDS[0]: results[SEEDS[0]]}, tiny)
    assert list(scores.columns) == ["", POLICY, *BASELINES, "paper"]
    assert list(failures.columns) == ["", POLICY, *BASELINES]
    assert [row[0] for row in failures.rows] == list(FAILURES)
    assert "1 held-out demonstrations" in scores.note
    shown = {row[0]: row[1:5] for row in scores.rows}
    evaluations = results[SEEDS[0]].evaluations
    means = [f"{evaluations[title].rows()['tracking_error_cm']:.2f} cm" for title in (POLICY, *BASELINES)]
    assert list(shown["tracking error, mean over all rollouts"]) == means
    assert any(title.startswith("still held") for title in shown), "rollouts go on after the demonstration"


def test_of_several_seeds_the_table_has_the_mean_and_the_range(results: dict[int, Results], tiny: Config):
    scores, _ = tables(results, tiny)
    assert list(scores.columns) == ["", "policy, mean of 2 seeds", "least to greatest", *BASELINES, "paper"]
    errors = [results[seed].evaluations[POLICY].rows()["tracking_error_cm"] for seed in SEEDS]
    (shown,) = [row for row in scores.rows if row[0] == "tracking error, mean over all rollouts"]
    assert shown[1] == f"{np.mean(errors):.2f} cm"
    least, greatest = f"{min(errors):.2f} cm", f"{max(errors):.2f} cm"
    assert shown[2] in (least, f"{least.removesuffix(' cm')} to {greatest}")


def test_each_seed_has_its_own_policy_and_all_share_the_baselines(results: dict[int, Results]):
    first, second = (results[seed] for seed in SEEDS)
    assert (first.checkpoint.steps, second.checkpoint.steps) != (0, 0)
    for title in BASELINES:
        assert first.rollouts[title] is second.rollouts[title]
    hard, pressed, alone = (np.asarray(first.rollouts[title].qpos) for title in (PRESS, ZERO, REPLAY))
    np.testing.assert_array_equal(pressed[:, 0], alone[:, 0])
    assert not np.array_equal(pressed, alone)
    assert not np.array_equal(pressed, hard)
    assert not np.array_equal(pressed, np.asarray(first.rollouts[POLICY].qpos))


def test_the_files_agree_with_each_other_and_with_the_rollouts(
    results: dict[int, Results], written: Path, configs: list[Config]
):
    assert written == Path(configs[0].out).parent
    summary = json.loads((written / "evaluation.json").read_text())
    assert (summary["experiment"], summary["engine"], summary["demonstrations"]) == ("tiny", "native", 1)
    assert summary["checkpoint_steps"] == {
        str(config.seed): load_checkpoint(Path(config.out) / "best.npz").steps for config in configs
    }
    assert summary["constant_press"] == dict(results[SEEDS[0]].press)
    assert summary["constant_press"]["pinch"].endswith(" N")
    table = rows(written / "evaluation.csv")
    kinds = [(POLICY, "4"), (POLICY, "7"), *((title, "") for title in BASELINES)]
    assert [(row["column"], row["seed"], row["demonstration"]) for row in table] == [(*kind, "0") for kind in kinds]
    for (title, seed), row in zip(kinds, table, strict=True):
        scores: Mapping[str, float] = summary["seeds"][seed] if seed else summary["scores"][title]
        assert list(row) == ["column", "seed", "demonstration", *scores, "failure"]
        np.testing.assert_allclose([float(row[name]) for name in scores], list(scores.values()), rtol=1e-5)
        assert (row["failure"] == "") == (float(row["manip_trans_object"]) == 1)
        if not seed:
            shares = summary["failures"][title]
            assert {reason for reason, share in shares.items() if share} == ({row["failure"]} - {""})
    for name, mean in summary["scores"][POLICY].items():
        assert mean == pytest.approx(np.mean([summary["seeds"][str(seed)][name] for seed in SEEDS]))
    failed = [(str(f["seed"]), str(f["demonstration"]), f["reason"]) for f in summary["failed"]]
    assert failed == [(r["seed"], r["demonstration"], r["failure"]) for r in table if r["seed"] and r["failure"]]


def test_the_page_shows_every_seed_and_its_videos(written: Path):
    page = (written / "evaluation.html").read_text()
    for words in ("seed 4", "seed 7", "0: box", "The worst rollout: seed", "Every demonstration", "seeds=[4,7]"):
        assert words in page, words
    films = json.loads((written / "evaluation.json").read_text())["films"]
    assert [films[name]["file"] for name in ("worst", "median")] == ["worst.mp4", "median.mp4"]
    assert page.count("<video") == 2


def test_without_a_renderer_the_page_says_why(
    results: dict[int, Results], configs: list[Config], tmp_path, monkeypatch
):
    def without_graphics(*_: object, **__: object) -> None:
        raise RendererUnavailable("no OpenGL here; install libegl1")

    monkeypatch.setattr(view_video, "open_renderer", without_graphics)
    monkeypatch.setattr(evaluate, "evaluate_seeds", lambda _: results)
    alone = dataclasses.replace(configs[0], out=str(tmp_path))
    folder, _ = evaluate_and_write([alone])
    assert folder == tmp_path
    assert "No video: no OpenGL here; install libegl1" in (tmp_path / "evaluation.html").read_text()


def test_what_was_evaluated_is_known_again_until_something_changes(
    written: Path, configs: list[Config], tmp_path, monkeypatch
):
    kept = cached_results(configs)
    assert kept is not None
    assert kept["experiment"] == "tiny"
    assert cached_results(configs[:1]) is None, "that was never evaluated alone"
    longer = [dataclasses.replace(c, ppo=dataclasses.replace(c.ppo, num_timesteps=999)) for c in configs]
    assert cached_results(longer) is None
    curve = Path(configs[1].out) / "curve.csv"
    curve.write_text("steps\n")
    assert cached_results(configs) is None, "it was trained further"
    curve.unlink()
    assert cached_results(configs) == kept
    monkeypatch.setattr(evaluation_record, "version", lambda _: "another")
    assert cached_results(configs) is None


def test_a_policy_is_not_scored_on_another_task(configs: list[Config], tmp_path):
    config = configs[0]
    changes = {
        "task.grip_force": {"task": dataclasses.replace(config.task, grip_force=9.0)},
        "data.trials": {"data": dataclasses.replace(config.data, trials=2)},
        "ppo.policy_layers": {"ppo": dataclasses.replace(config.ppo, policy_layers=(8,))},
    }
    for option, change in changes.items():
        with pytest.raises(InputError, match=f"holds a training with {option}="):
            chosen_checkpoint(dataclasses.replace(config, **change), 0)
    with pytest.raises(InputError, match="is a policy of 'tiny', now 'power'"):
        chosen_checkpoint(dataclasses.replace(config, name="power"), 0)
    with pytest.raises(InputError, match=r"seeds 4 and 7 were trained with other task\.grip_force"):
        evaluate_seeds([config, dataclasses.replace(configs[1], **changes["task.grip_force"])])


def test_the_command_takes_the_settings_of_the_run(trained: Trained, tiny: Config, tmp_path):
    """Of its folder, or of the policy itself where it has left its folder."""
    usual = compose([f"demonstrations={tiny.demonstrations}"])
    wanted = (tiny.name, tiny.task, tiny.data, tiny.ppo.policy_layers)
    shutil.copy(trained[0] / "best.npz", tmp_path / "moved.npz")
    for place in ({"out": str(trained[0])}, {"checkpoint": str(tmp_path / "moved.npz")}):
        found = settled(dataclasses.replace(usual, **place), [*place, "demonstrations"])
        assert (found.name, found.task, found.data, found.ppo.policy_layers) == wanted
    other = dataclasses.replace(usual, out=str(trained[0]))
    task = dataclasses.replace(usual.task, grip_force=9.0)
    with pytest.raises(InputError, match=r"holds a training with task\.grip_force=.*, now 9\.0; leave out that option"):
        settled(dataclasses.replace(other, task=task), ["out", "task.grip_force"])
    with pytest.raises(InputError, match=r"holds a training with name=tiny, now pinch"):
        settled(other, ["out", "config"])
    assert settled(dataclasses.replace(other, engine="mjx"), ["out", "engine"]).engine == "mjx"
    assert settled(dataclasses.replace(other, part="sealed"), ["out", "part"]).part == "sealed"
    assert settled(dataclasses.replace(other, out=str(tmp_path / "gone")), ["out"]).name == "pinch"


def test_results_of_several_seeds_go_above_their_folders(tiny: Config):
    outs = [dataclasses.replace(tiny, out=f"outputs/tiny/seed{seed}") for seed in SEEDS]
    assert shared_folder(outs) == Path("outputs/tiny")
    assert shared_folder(outs[:1]) == Path("outputs/tiny/seed4")


def test_a_seed_that_is_not_trained_is_named_with_the_command_that_trains_it(configs: list[Config], tmp_path):
    missing = dataclasses.replace(configs[0], seed=9, out="outputs/tiny/seed9", demonstrations=str(tmp_path / "none"))
    with pytest.raises(InputError, match=r"seed 9 of 'tiny': no such checkpoint.*train\.ppo config=tiny seed=9$"):
        evaluate_seeds([configs[0], missing])
    elsewhere = dataclasses.replace(missing, out=str(tmp_path / "gone"))
    with pytest.raises(InputError, match=f"seed=9 out={tmp_path / 'gone'}$"):
        evaluate_seeds([elsewhere])
    assert not (tmp_path / "none").exists(), "nothing was made before"
