import subprocess
import sys
from pathlib import Path

import jax
import pytest

from envs.physics import default_engine
from mjx_hand.errors import InputError
from train.settings.config import compose
from train.settings.device import use_device, with_device
from train.settings.options import Distributed, Ppo

ROOT = Path(__file__).resolve().parent.parent.parent.parent


@pytest.fixture
def gpu(monkeypatch):
    """JAX says that it computes on a GPU."""
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")


def test_without_a_word_it_is_what_jax_computes_on():
    assert with_device([]) == ["device=cpu"]
    assert with_device(["device=auto", "seed=1"]) == ["device=cpu", "seed=1"]
    assert compose().device == "cpu"


def test_on_a_gpu_the_preset_and_warp_are_chosen(gpu, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: object())
    config = compose(["config=power"])
    assert (config.device, config.engine, default_engine()) == ("gpu", "auto", "warp")
    assert config.ppo.num_envs == 8192
    assert compose(["config=power", "device=cpu"]).ppo.num_envs == 256


def test_a_preset_changes_the_learner_alone_and_budgets_stay_those_of_the_experiment():
    cpu, gpu = (compose(["config=spherical", f"device={name}"]) for name in ("cpu", "gpu"))
    assert (cpu.task, cpu.data, cpu.checks) == (gpu.task, gpu.data, gpu.checks)
    assert cpu.ppo.num_updates == gpu.ppo.num_updates == 200, "an experiment's own budget is one of updates"
    assert gpu.ppo.budget * gpu.ppo.steps_per_update == 200 * 8192 * gpu.ppo.unroll_length


def test_an_experiment_and_the_command_line_win_over_a_preset():
    assert compose(["device=gpu", "ppo.num_envs=64"]).ppo.num_envs == 64
    assert compose(["ppo.num_envs=64", "device=gpu"]).ppo.num_envs == 64


def test_overrides_stay_in_one_piece_whatever_flags_stand_around_them():
    assert with_device(["--cfg", "job", "seed=1", "ppo.num_envs=8"]) == [
        "--cfg",
        "job",
        "device=cpu",
        "seed=1",
        "ppo.num_envs=8",
    ]
    assert with_device(["--cfg", "job"]) == ["device=cpu", "--cfg", "job"]


def test_before_several_processes_have_joined_jax_is_not_asked(gpu, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert with_device(["distributed.processes=2"]) == ["device=cpu", "distributed.processes=2"]
    assert with_device(["distributed.processes=1"])[0] == "device=gpu"


def test_a_device_that_is_not_here_or_not_known_is_refused():
    with pytest.raises(InputError, match=r"device=gpu, but JAX finds no GPU here; .*pip install 'mjx-hand\[cuda\]'"):
        use_device("gpu", Distributed())
    with pytest.raises(InputError, match="device is 'tpu'; valid: auto, cpu, gpu"):
        compose(["device=tpu"])


def test_the_command_refuses_a_gpu_that_is_not_here_in_one_line(tmp_path):
    command = [sys.executable, "-m", "train.ppo", "device=gpu", f"out={tmp_path / 'out'}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("train: device=gpu, but JAX finds no GPU here")
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("given", "updates"),
    [({}, 400), ({"num_updates": 9}, 9), ({"num_timesteps": 600_000}, 147), ({"num_timesteps": 1}, 1)],
)
def test_a_budget_is_in_updates_or_in_steps(given, updates):
    assert Ppo(**given).budget == updates
