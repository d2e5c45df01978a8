"""Ablations: what is planned, what is kept, what the page says; and one real run over a tiny training."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from tests.train.test_results import curve, row, summary
from train import ablations, experiments
from train.ablations import Plan, plan, run
from train.experiment.evaluate_seeds import POLICY, REPLAY, ZERO
from train.learning.curve import Point
from train.learning.run_folder import run_folder
from train.ppo import _write_curve
from train.reports.ablations_page import Ablation, ablation_table, write_ablations_page
from train.reports.ablations_variants import UNCHANGED, VARIANTS
from train.reports.evaluation_record import evaluation_fingerprint
from train.reports.results_table import Experiment
from train.settings.config import Config
from train.settings.saved import settings_of
from train.view import video

NO_GRIP = next(variant for variant in VARIANTS if variant.name == "no grip")
RESIDUAL_OFF, ALONE = (next(variant for variant in VARIANTS if variant.column == column) for column in (ZERO, REPLAY))


def experiment(success: Sequence[float], folder: Path = Path("there"), zero: float = 0.25) -> Experiment:
    curves = {seed: curve(0.1, value) for seed, value in enumerate(success)}
    told = summary("spherical", success, zero)
    for scores in (*told["scores"].values(), *told["seeds"].values()):
        scores["manip_trans_object"] = scores["kept"]  # what ablations are told by
    return Experiment("spherical", folder, told, curves)


def test_the_plan_without_options_is_every_variant_at_one_budget():
    (planned,), folder = plan([])
    assert (planned.name, planned.steps, folder) == ("spherical", 300_000, Path("outputs/ablations"))
    assert [variant for variant, _ in planned.variants] == list(VARIANTS)
    configs = [config for _, configs in planned.variants for config in configs]
    assert {config.ppo.num_timesteps for config in configs} == {300_000}
    assert {config.checks.stop_at for config in configs} == {2.0}
    assert len({config.out for config in configs}) == 3 * len(VARIANTS)
    assert [[config.seed for config in configs] for _, configs in planned.variants] == [[0, 1, 2]] * len(VARIANTS)


def test_every_variant_changes_what_it_says_and_nothing_else():
    (planned,), _ = plan(["seeds=[0]"])
    (unchanged,) = planned.variants[0][1]
    for variant, (config,) in planned.variants:
        said = {override.partition("=")[0] for override in variant.overrides}
        now, before = settings_of(config), settings_of(unchanged)
        assert {name for name in now if now[name] != before[name]} == said, variant.name
        assert bool(said) == (variant.learns and variant != UNCHANGED)


def test_the_plan_takes_names_variants_and_overrides():
    planned, folder = plan(
        ["names=[pinch,power]", 'variants=["no grip"]', "results=there", "ppo.num_timesteps=9", "seed=4"]
    )
    assert [(one.name, one.steps) for one in planned] == [("pinch", 9), ("power", 9)]
    assert [[v.name for v, _ in one.variants] for one in planned] == [["as configured", "no grip"]] * 2
    (config,) = planned[1].variants[1][1]
    assert (config.task.grip_force, config.seed, config.out) == (0, 4, "there/power/no_grip/seed4")
    assert folder == Path("there")


def test_a_variant_prevails_over_what_holds_for_all():
    (planned,), _ = plan(["task.grip_force=3", 'variants=["no grip"]', "seed=0"])
    assert [config.task.grip_force for _, (config,) in planned.variants] == [3, 0]


@pytest.mark.parametrize(
    ("argument", "said"),
    [
        ("config=pinch", "names=[...] here"),
        ("variants=[no grp]", "variant 'no grp' is not known; valid: as configured, residual off"),
        ("variants=[]", "names nothing"),
        ("out=here/seed${seed}", "results=FOLDER"),
        ("checks.stop_at=0.9", "equal budgets"),
        ("names=[pich]", "pich"),
    ],
)
def test_what_cannot_be_used_is_refused_before_any_work(argument, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert ablations.main([argument]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("ablations: ")
    assert said in line
    assert list(tmp_path.iterdir()) == []


def test_rows_are_means_over_seeds_with_the_least_and_the_greatest():
    unchanged, without = experiment([1.0, 0.9, 0.95]), experiment([0.5, 0.3, 0.4], zero=0.0)
    measured = [(UNCHANGED, unchanged), (RESIDUAL_OFF, unchanged), (ALONE, unchanged), (NO_GRIP, without)]
    table = ablation_table(Ablation("spherical", 9, measured))
    assert row(table, "as configured")["success"] == "95.0 % (90.0 to 100)"
    assert row(table, "as configured")["tracking error"] == "0.40 cm", "equal seeds have no range"
    assert (row(table, "as configured")["zero residual"], row(table, "no grip")["zero residual"]) == ("25.0 %", "0.0 %")
    assert row(table, "no grip")["success"] == "40.0 % (30.0 to 50.0)"
    assert (row(table, "residual off")["success"], row(table, "residual off")["zero residual"]) == ("25.0 %", "")
    assert row(table, "demonstration alone")["success"] == "0.0 %"


def test_the_page_says_what_is_done_and_what_is_not(tmp_path):
    unchanged = experiment([1.0, 0.9], tmp_path / "spherical" / "as_configured")
    measured = [(UNCHANGED, unchanged), (RESIDUAL_OFF, unchanged), (NO_GRIP, experiment([0.5, 0.3]))]
    write_ablations_page([Ablation("spherical", 300_000, measured, ["tips refined"])], tmp_path, "the command")
    page, text = (tmp_path / name for name in ("index.html", "ablations.md"))
    for content in (page.read_text(), text.read_text()):
        assert "Not done yet: spherical (tips refined)." in content
        assert "95.0 % (90.0 to 100)" in content
        assert "task.grip_force=0" in content
        assert "300,000 control steps" in content
        assert "the command" in content
    assert page.read_text().count("<svg") == 1, "a figure a group of variants that learn"
    assert "least: no grip" in page.read_text()
    assert "(<spherical/as_configured/evaluation.html>)" in text.read_text()
    figures = json.loads((tmp_path / "ablations.json").read_text())["experiments"]["spherical"]
    assert figures["steps"] == 300_000
    assert figures["variants"]["residual off"]["scores"]["manip_trans_object"] == 0.25
    assert list(figures["variants"]["no grip"]["seeds"]) == ["0", "1"]
    assert "curves" not in figures["variants"]["residual off"]


@pytest.fixture
def work(monkeypatch, tmp_path) -> list[str]:
    """What was trained and evaluated, in order, by stand-ins that leave the files of the real ones."""
    done: list[str] = []
    monkeypatch.chdir(tmp_path)

    def train(config: Config, env: Any) -> None:
        done.append(f"train {Path(config.out).parent.name} {config.seed}")
        Path(config.out).mkdir(parents=True, exist_ok=True)
        _write_curve(curve(0.1, 0.96), Path(config.out) / "curve.csv")

    def evaluate(configs: Sequence[Config]) -> None:
        content = summary("spherical", [1.0] * len(configs)) | {"made_of": evaluation_fingerprint(configs)}
        (Path(configs[0].out).parent / "evaluation.json").write_text(json.dumps(content))

    monkeypatch.setattr(experiments, "training_env", lambda config: None)
    monkeypatch.setattr(experiments, "make_missing_sets", lambda data, root, sealed=False: None)
    monkeypatch.setattr(experiments, "train", train)
    monkeypatch.setattr(experiments, "evaluate_and_write", evaluate)
    monkeypatch.setattr(experiments, "enable_compile_cache", lambda: None)
    return done


def test_what_is_done_is_kept_and_the_rest_goes_on(work: list[str]):
    few = ["seeds=[0,1]", "ppo.num_timesteps=1000"]
    assert ablations.main(["variants=[residual off]", *few]) == 0
    assert work == ["train as_configured 0", "train as_configured 1"]
    work.clear()
    assert ablations.main(["variants=[residual off,no grip]", *few]) == 0
    assert work == ["train no_grip 0", "train no_grip 1"]
    page = Path("outputs/ablations/ablations.md").read_text()
    assert "Not done yet" not in page
    assert all(f"| {name} |" in page for name in ("as configured", "residual off", "no grip"))


def test_variants_that_are_done_are_shown_while_others_wait(work: list[str], monkeypatch, capsys):
    def train(config: Config, env: Any) -> None:
        if config.task.grip_force == 0:
            raise InputError("the disk is full")
        first(config, env)

    first = experiments.train
    monkeypatch.setattr(experiments, "train", train)
    assert ablations.main(["variants=[residual off,no grip]", "seeds=[0,1]", "ppo.num_timesteps=1000"]) == 2
    assert capsys.readouterr().err == "ablations: the disk is full\n"
    assert "Not done yet: spherical (no grip)." in Path("outputs/ablations/ablations.md").read_text()


@pytest.mark.slow
def test_a_tiny_training_and_its_baselines(
    trained: tuple[Path, list[Point]], tiny: Config, env: TrackingEnv, tmp_path, monkeypatch
):
    monkeypatch.setattr(experiments, "training_env", lambda config: env)
    monkeypatch.setattr(experiments, "make_missing_sets", lambda data, root, sealed=False: None)
    monkeypatch.setattr(video, "side_by_side", lambda env, rollouts, index, path: Path(path).write_bytes(b"film"))
    out = tmp_path / "tiny" / "as_configured" / "seed0"
    shutil.copytree(trained[0], out)
    configs = [Config(**{**vars(tiny), "out": str(out)})]
    planned = Plan("tiny", [(variant, configs) for variant in (UNCHANGED, RESIDUAL_OFF, ALONE)])
    run([planned], tmp_path, "the command")
    told = json.loads((tmp_path / "ablations.json").read_text())["experiments"]["tiny"]
    summary = json.loads((out / "evaluation.json").read_text())
    assert told["steps"] == tiny.ppo.num_timesteps
    assert {name: v["scores"] for name, v in told["variants"].items()} == {
        "as configured": summary["scores"][POLICY],
        "residual off": summary["scores"][ZERO],
        "demonstration alone": summary["scores"][REPLAY],
    }
    assert [p["steps"] for p in told["variants"]["as configured"]["curves"]["0"]] == [p.steps for p in trained[1]]


def test_a_training_from_before_an_option_was_there_goes_on(tiny: Config, tmp_path):
    config = Config(**{**vars(tiny), "out": str(tmp_path)})
    with run_folder(config):
        pass
    (tmp_path / "state").mkdir()
    written = tmp_path / "config.yaml"
    old = [line for line in written.read_text().splitlines() if not line.strip().startswith("axes:")]
    assert len(old) == len(written.read_text().splitlines()) - 1
    written.write_text("\n".join(old))
    with run_folder(config):
        pass
    other = plan(["names=[pinch]", "variants=[functional axes]", "seed=0"])[0][0].variants[1][1][0]
    changed = Config(**{**vars(config), "data": other.data, "task": config.task})
    refused = pytest.raises(InputError, match=r"holds a training with data.capture.axes=anatomical, now functional")
    with refused, run_folder(changed):
        pass


def test_every_variant_says_why():
    names = [variant.name for variant in VARIANTS]
    assert len(set(names)) == len(names)
    assert all(variant.why.endswith((".", "?")) for variant in VARIANTS)


def test_help_says_what_it_takes(capsys):
    assert ablations.main(["--help"]) == 0
    assert "names=[spherical]" in capsys.readouterr().out
