"""The results of several experiments, from what their evaluations left on disk; nothing is trained here."""

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from envs.evaluation.failure import FAILURES
from envs.grasps import FIVE
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from train import experiments, results
from train.learning.curve import Point, is_finished, load_curve, minutes_to_learn
from train.ppo import _write_curve
from train.reports.evaluation_record import evaluation_fingerprint
from train.reports.published import PAPER
from train.reports.results_page import write_results_page
from train.reports.results_table import Experiment, failures_table, results_table
from train.reports.stress_summary import stress_summary
from train.settings.config import Config
from train.settings.options import Checks, Ppo

METRICS = {
    "tracking_error_cm": 0.4,
    "moving_error_cm": 0.6,
    "object_rotation_error_deg": 5.0,
    "hold": 0.9,
    "chord": 0.8,
    "manip_trans_object": 0.7,
    "manip_trans_frames": 0.6,
}


def curve(*successes: float, minutes: float = 1.0) -> list[Point]:
    return [Point(1000 * k, 60 * minutes * k, success, 1.0, 9.0) for k, success in enumerate(successes)]


def summary(grasp: str, success: Sequence[float], zero: float = 0.25, failed: Sequence[Any] = ()) -> dict[str, Any]:
    def scores(value: float) -> dict[str, float]:
        return {"kept": value, **METRICS}

    shares = dict.fromkeys(FAILURES, 0.0)
    return {
        "grasp": grasp,
        "engine": "native",
        "demonstrations": 32,
        "scores": {
            "policy": scores(sum(success) / len(success)),
            "constant press": scores(0.75),
            "zero residual": scores(zero),
            "demonstration alone": scores(0.0),
        },
        "part": "sealed",
        "people": {"pinch 0": scores(0.5), "pinch 1": scores(0.9)},
        "intervals": {"policy": {"kept": (0.5, 0.99)}},
        "seeds": {str(seed): scores(value) for seed, value in enumerate(success)},
        "failures": {"policy": shares | {"dropped": 1 - sum(success) / len(success)}, "zero residual": shares},
        "failed": [dict(zip(("seed", "demonstration", "reason"), f, strict=True)) | METRICS for f in failed],
        "films": {"worst": {"file": None, "caption": "The worst.", "missing": "no renderer here"}},
    }


def experiment(grasp: str, success: Sequence[float], folder: Path = Path(), **change: Any) -> Experiment:
    given = {"curves": {seed: curve(0.1, 0.96, minutes=seed + 1.0) for seed in range(len(success))}, **change}
    curves = given.pop("curves")
    return Experiment(grasp, folder / grasp, summary(grasp, success, **given), curves)


def row(table, name: str) -> dict[str, str]:
    (found,) = [row for row in table.rows if row[0] == name]
    return dict(zip(table.columns, found, strict=True))


def test_a_row_an_experiment_with_the_papers_beside():
    table = results_table([experiment("pinch", [1.0, 0.9]), experiment("lateral", [0.8, 1.0], zero=0.5)])
    shown = row(table, "lateral")
    assert (shown["followed"], shown["least seed"]) == ("90.0 % (50 to 99)", "80.0 %")
    assert shown["least person"] == "50.0 %"
    assert (shown["paper's success"], shown["paper's tracking error"]) == ("80.2 %", "0.75 cm")
    assert (shown["zero residual"], shown["demonstration alone"]) == ("50.0 %", "0.0 %")
    assert [shown[f"constant press{what}"] for what in ("", ", ManipTrans")] == ["75.0 %", "70.0 %"]
    assert [shown[f"ManipTrans{what}"] for what in ("", ", each frame")] == ["70.0 %", "60.0 %"]
    assert (shown["held 5 s"], shown["CHORD"], shown["rotation error"]) == ("90.0 %", "80.0 %", "5.0°")
    assert (shown["tracking error"], shown["while moving"]) == ("0.40 cm", "0.60 cm")
    assert (shown["minutes to 95 %"], shown["minutes of training"]) == ("1.5", "1.5")


def test_the_mean_is_over_experiments_and_its_least_seed_over_whole_seeds():
    mean = row(results_table([experiment("pinch", [1.0, 0.9]), experiment("lateral", [0.8, 1.0])]), "mean")
    assert (mean["followed"], mean["least seed"]) == ("92.5 %", "90.0 %")  # seed 0: 90 %, seed 1: 95 %
    assert mean["paper's success"] == "", "the paper's mean is over its five types"
    unequal = row(results_table([experiment("pinch", [1.0]), experiment("lateral", [0.8, 1.0])]), "mean")
    assert unequal["least seed"] == ""


def test_the_papers_mean_stands_beside_the_mean_of_its_five():
    mean = row(results_table([experiment(name, [1.0]) for name in FIVE]), "mean")
    assert len(FIVE) == 5
    assert mean["paper's success"] == "77.9 %"
    assert PAPER["all"].success == pytest.approx(sum(PAPER[name].success for name in FIVE) / 5, abs=1e-3)


def test_an_experiment_that_the_paper_has_not():
    table = results_table([experiment("mustard", [0.9])])
    assert len(table.rows) == 1, "one experiment is its own mean"
    assert row(table, "mustard")["paper's success"] == ""


def test_what_is_put_down_has_no_hold():
    down = experiment("mustard", [0.9])
    for scores in down.summary["scores"].values():
        del scores["hold"]
    table = results_table([down, experiment("pinch", [1.0])])
    assert [row(table, name)["held 5 s"] for name in ("mustard", "pinch", "mean")] == ["", "90.0 %", ""]


def test_disturbances_stand_beside_each_other_where_all_were_tested():
    def tested(policy: float, press: float) -> dict[str, Any]:
        shares = {"policy": {"kept": policy}, "constant press": {"kept": press}}
        return {"rows": {"as recorded": shares, "mass × 2": {**shares, "policy": {"kept": policy - 0.5}}}}

    pair = [
        dataclasses.replace(experiment("pinch", [1.0]), stress=tested(1.0, 0.5)),
        dataclasses.replace(experiment("power", [1.0]), stress=tested(0.9, 0.8)),
    ]
    table = stress_summary(pair)
    assert table is not None
    assert row(table, "mass × 2") == {
        "disturbance": "mass × 2",
        "pinch": "50.0 / 50.0",
        "power": "40.0 / 80.0",
        "mean": "45.0 / 65.0",
    }
    assert stress_summary([*pair, experiment("lateral", [1.0])]) is None
    assert stress_summary(pair[:1]).columns == ("disturbance", "pinch")  # type: ignore[union-attr]


def test_seeds_that_never_learned_are_told_apart():
    slow = experiment("pinch", [1.0, 0.5], curves={0: curve(0.1, 0.5, 0.95), 1: curve(0.1, 0.2)})
    assert row(results_table([slow]), "pinch")["minutes to 95 %"] == "2.0 (1 of 2)"
    never = experiment("pinch", [0.5], curves={0: curve(0.1, 0.2)})
    assert row(results_table([never]), "pinch")["minutes to 95 %"] == "not reached"


def test_every_failure_is_listed_by_demonstration():
    failed = [(1, 7, "dropped"), (0, 9, "late"), (0, 7, "rotated")]
    table = failures_table([experiment("pinch", [0.9, 0.9], failed=failed)])
    assert [row[:3] for row in table.rows] == [
        ("pinch, demonstration 7", "seed 0", "rotated"),
        ("pinch, demonstration 7", "seed 1", "dropped"),
        ("pinch, demonstration 9", "seed 0", "late"),
    ]


def test_the_pages_say_what_is_done_and_what_is_not(tmp_path):
    done = [experiment("pinch", [1.0, 0.9], tmp_path, failed=[(1, 7, "dropped")]), experiment("lateral", [1.0, 1.0])]
    write_results_page(done, ["power"], tmp_path / "results", "python -m train.results")
    page, text = (tmp_path / "results" / name for name in ("index.html", "results.md"))
    for content in (page.read_text(), text.read_text()):
        assert "Not done yet: power." in content
        assert "pinch, demonstration 7" in content
        assert "82.3 %" in content
        assert "python -m train.results" in content
    assert page.read_text().count("<svg") == 2
    assert "No video: no renderer here" in page.read_text()
    tables = [line for line in text.read_text().splitlines() if line.startswith("|")]
    assert len({line.count("|") for line in tables[:5]}) == 1, "every row has every column"
    assert "[every demonstration](../pinch/evaluation.html)" in text.read_text()
    figures = json.loads((tmp_path / "results" / "results.json").read_text())
    assert figures["experiments"]["pinch"]["minutes_to_learn"] == [1.0, 2.0]
    assert figures["table"]["rows"][0][:2] == ["pinch", "95.0 % (50 to 99)"]


def test_a_video_that_is_gone_is_said_to_be(tmp_path):
    lost = experiment("pinch", [1.0], tmp_path)
    lost.summary["films"]["worst"]["file"] = "worst.mp4"
    write_results_page([lost], [], tmp_path, "command")
    assert "worst.mp4 is gone; delete" in (tmp_path / "index.html").read_text()


def test_curves_are_read_as_they_were_written(tmp_path):
    points = curve(0.1, 0.5, 0.97, 0.6)
    assert load_curve(tmp_path) == []
    _write_curve(points, tmp_path / "curve.csv")
    assert load_curve(tmp_path) == points
    assert minutes_to_learn(points) == 2.0
    (tmp_path / "curve.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="not a learning curve; delete it"):
        load_curve(tmp_path)


def test_a_training_is_finished_by_its_steps_or_by_what_it_may_stop_at():
    config = Config(ppo=Ppo(num_timesteps=2000), checks=Checks(stop_at=0.97))
    assert is_finished(config, curve(0.1, 0.2, 0.3))
    assert is_finished(config, curve(0.1, 0.98))
    assert not is_finished(config, curve(0.1, 0.96))
    assert not is_finished(config, [])


def test_the_plan_without_options_is_the_papers_five_with_three_seeds():
    experiments, folder = results.plan([])
    assert [[(c.name, c.seed) for c in configs] for configs in experiments] == [
        [(name, seed) for seed in range(3)] for name in ("power", "pinch", "lateral", "cylindrical", "spherical")
    ]
    assert folder == Path("outputs/results")


def test_the_plan_takes_names_seeds_and_overrides():
    experiments, folder = results.plan(
        ["names=[lateral, pinch,lateral]", "seeds=[4]", "results=there", "ppo.num_timesteps=9"]
    )
    assert [(c.name, c.seed, c.ppo.num_timesteps) for (c,) in experiments] == [("lateral", 4, 9), ("pinch", 4, 9)]
    assert folder == Path("there")
    assert [c.seed for (c,) in results.plan(["names=pinch", "seed=7"])[0]] == [7]


@pytest.mark.parametrize(
    ("argument", "said"),
    [
        ("config=pinch", "names=[...] here"),
        ("names=[]", "names nothing; give for example names=[power,pinch,"),
        ("names=[pich]", "pich"),
        ("ppo.num_env=8", "did you mean ppo.num_envs?"),
        ("out=here/seed${seed}", "several experiments into here"),
    ],
)
def test_what_cannot_be_used_is_refused_before_any_work(argument, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert results.main([argument]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("results: ")
    assert said in line
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def work(monkeypatch, tmp_path) -> list[str]:
    """What was trained and evaluated, in order, by stand-ins that leave the files of the real ones."""
    done: list[str] = []
    monkeypatch.chdir(tmp_path)

    def train(config: Config, env: TrackingEnv) -> None:
        done.append(f"train {config.name} {config.seed}")
        Path(config.out).mkdir(parents=True, exist_ok=True)
        _write_curve(curve(0.1, 0.96, minutes=config.seed + 1.0), Path(config.out) / "curve.csv")

    def evaluate(configs: Sequence[Config]) -> None:
        done.append(f"evaluate {configs[0].name}")
        content = summary(configs[0].data.grasp, [1.0] * len(configs)) | {"made_of": evaluation_fingerprint(configs)}
        (Path(configs[0].out).parent / "evaluation.json").write_text(json.dumps(content))
        kept = {"policy": {"kept": 1.0}, "constant press": {"kept": 0.5}}
        content = {"rows": {"as recorded": kept}, "made_of": evaluation_fingerprint(configs)}
        if configs[0].stress:
            (Path(configs[0].out).parent / "stress.json").write_text(json.dumps(content))

    monkeypatch.setattr(experiments, "training_env", lambda config: None)
    monkeypatch.setattr(experiments, "make_missing_sets", lambda data, root, sealed=False: None)
    monkeypatch.setattr(experiments, "train", train)
    monkeypatch.setattr(experiments, "evaluate_and_write", evaluate)
    monkeypatch.setattr(experiments, "enable_compile_cache", lambda: None)
    return done


def test_what_is_done_is_kept_and_the_rest_goes_on(work: list[str], capsys):
    few = ["seeds=[0,1]", "ppo.num_timesteps=1000"]
    assert results.main(["names=[pinch]", *few]) == 0
    assert work == ["train pinch 0", "train pinch 1", "evaluate pinch"]
    assert "| as recorded | 100.0 / 50.0 |" in Path("outputs/results/results.md").read_text()
    work.clear()
    assert results.main(["names=[pinch,lateral]", *few]) == 0
    assert work == ["train lateral 0", "train lateral 1", "evaluate lateral"]
    assert "trained and evaluated already (outputs/pinch)" in capsys.readouterr().out
    work.clear()
    assert results.main(["names=[pinch]", "seeds=[0,1]", "ppo.num_timesteps=2000"]) == 0
    assert work[-1] == "evaluate pinch", "other settings are another experiment"
    work.clear()
    Path("outputs/pinch/stress.json").unlink()
    assert results.main(["names=[pinch]", "seeds=[0,1]", "ppo.num_timesteps=2000"]) == 0
    assert work[-1] == "evaluate pinch", "a stress test is missing"
    work.clear()
    assert results.main(["names=[pinch]", "seeds=[0,1]", "ppo.num_timesteps=2000", "fresh=true"]) == 0
    assert work == ["train pinch 0", "train pinch 1", "evaluate pinch"]


def test_one_experiment_that_is_done_is_shown_while_others_wait(work: list[str], monkeypatch):
    def train(config: Config, env: TrackingEnv) -> None:
        if config.name == "lateral":
            raise InputError("the disk is full")
        first(config, env)

    first = experiments.train
    monkeypatch.setattr(experiments, "train", train)
    assert results.main(["names=[pinch,lateral]", "seeds=[0,1]", "ppo.num_timesteps=1000"]) == 2
    assert work == ["train pinch 0", "train pinch 1", "evaluate pinch"]
    assert "Not done yet: lateral." in Path("outputs/results/results.md").read_text()


def test_ctrl_c_ends_in_one_line(work: list[str], monkeypatch, capsys):
    def stop(config: Config) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(experiments, "training_env", stop)
    monkeypatch.setattr(experiments, "make_missing_sets", lambda data, root, sealed=False: None)
    assert results.main(["names=[pinch]", "seeds=[0,1]", "ppo.num_timesteps=1000"]) == 130
    assert capsys.readouterr().err == "\nresults: stopped; the same command goes on from here\n"


def test_help_says_what_it_takes(capsys):
    assert results.main(["--help"]) == 0
    assert "names=[power,pinch]" in capsys.readouterr().out
