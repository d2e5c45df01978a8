import json
import time
from importlib.util import find_spec

import jax
import pytest

from train.benchmark import __main__ as benchmark
from train.benchmark.__main__ import main
from train.benchmark.gpu import bench, command, learning
from train.benchmark.gpu.budget import Budget
from train.benchmark.gpu.scale import FULL, REHEARSAL, gpu_config


@pytest.mark.skipif(jax.default_backend() != "cpu", reason="there is a GPU")
def test_without_a_gpu_one_line_says_how_to_get_one(tmp_path, capsys):
    assert main(["gpu", "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "JAX has no GPU here" in error
    assert "pip install 'mjx-hand[cuda]'" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--minutes", "0"], "minutes is 0; give more than 0"),
        (["--stages", "phsyics"], "stage 'phsyics' is not known; valid: machine, agreement, physics, peer"),
    ],
)
def test_bad_options_end_in_one_line_and_status_2(options, message, tmp_path, capsys):
    assert main(["gpu", "--rehearse", "--out", str(tmp_path), *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_it_runs_by_its_name_alone():
    assert "gpu" in benchmark.BY_NAME
    assert set(benchmark.BY_NAME) < set(benchmark.MODULES)


def test_the_machine_is_described_within_the_time(tmp_path, capsys):
    assert main(["gpu", "--rehearse", "--stages", "machine", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr()
    assert (tmp_path / "gpu.md").read_text() in printed.out
    assert "[9 min 00 s left] machine: Machine" in printed.err
    (stage,) = json.loads((tmp_path / "gpu.json").read_text())["stages"]
    told = dict(stage["tables"][0]["rows"])
    assert told["mujoco"] == "4.0.0"
    assert told["memory, GiB"] > 0.5


def test_time_that_is_over_skips_what_is_left(tmp_path):
    assert main(["gpu", "--rehearse", "--minutes", "0.001", "--out", str(tmp_path)]) == 0
    stages = json.loads((tmp_path / "gpu.json").read_text())["stages"]
    assert [stage["status"] for stage in stages] == ["skipped"] * len(stages)
    assert all("were left" in stage["reason"] for stage in stages)


def test_stages_come_with_the_most_telling_first(tmp_path):
    budget = Budget.of(9.0, time.monotonic)
    full = command.stages(bench.Bench(FULL, budget, "warp", tmp_path, tmp_path))
    names = [stage.name for stage in full]
    assert names[:5] == ["machine", "agreement", "physics", "peer", "ppo"]
    assert names[-1] == "long"
    assert sum(stage.needs for stage in full) < 9 * 60  # so that none is lost where all take what they are said to
    assert {8192, 32768} <= set(FULL.worlds)
    rehearsed = command.stages(bench.Bench(REHEARSAL, budget, "warp", tmp_path, tmp_path))
    assert [stage.name for stage in rehearsed] == names


def test_the_engine_is_the_one_that_training_picks_on_a_gpu(monkeypatch):
    monkeypatch.setattr(bench, "accelerator", lambda: "H100")
    monkeypatch.setattr(bench, "default_engine", lambda: "warp")
    assert bench.measured_engine() == "warp"
    monkeypatch.setattr(bench, "accelerator", lambda: None)
    monkeypatch.setattr(bench, "find_spec", lambda name: None)
    assert bench.measured_engine() == "native"


def test_the_experiment_has_many_worlds_and_an_evaluation_every_ten_updates(tmp_path):
    config = gpu_config("all", FULL, tmp_path / "sets", tmp_path / "out")
    assert (config.data.grasp, config.ppo.num_envs, config.checks.stop_at) == ("all", 8192, 0.95)
    assert config.checks.every == 10 * config.ppo.steps_per_update
    assert learning._longer(config, 10**8).ppo.num_timesteps == 10**8
    assert learning._longer(config, 10**8).checks.stop_at > 1


@pytest.mark.slow
def test_a_rehearsal_runs_every_stage(demonstrations, tmp_path):
    folders = ("--out", str(tmp_path), "--demonstrations", str(demonstrations))
    assert main(["gpu", "--rehearse", "--prepare", *folders]) == 0
    assert main(["gpu", "--rehearse", "--minutes", "40", *folders]) == 0
    stages = {stage["name"]: stage for stage in json.loads((tmp_path / "gpu.json").read_text())["stages"]}
    warp = find_spec("warp") is not None
    assert {name: stage["status"] for name, stage in stages.items()} == {
        **dict.fromkeys(("machine", "agreement", "physics", "ppo", "learn", "host", "learn-several", "long"), "done"),
        "peer": "done" if warp and find_spec("dexi_rs") else "failed",
    }
    assert any(note.endswith("within all limits.") for note in stages["agreement"]["notes"])
    (rates, *_) = stages["physics"]["tables"]
    assert all(row[3] > 0 for row in rates["rows"])
    steps = [[row[0] for row in stages[name]["tables"][0]["rows"]] for name in ("learn", "learn-several", "long")]
    assert steps == [[0, 16, 24], [0, 16, 24], [32, 40]]  # the last goes on from where the one before it ended
    assert (tmp_path / "learn" / "best.npz").is_file()
    set_ups = [row[1] for row in stages["host"]["tables"][0]["rows"]]
    assert set_ups == ["native physics, learner where JAX computes", "native, all on the CPU"]
