import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from mjx_hand.errors import InputError
from tests.train.commands import arguments
from train.learning import sweep as module
from train.learning.sweep import combinations, sweep
from train.settings.config import Config

ROOT = Path(__file__).resolve().parent.parent.parent.parent
LAUNCHERS = ("basic", "joblib", "submitit_local")


def task(config: Config) -> Mapping[str, object] | None:
    """Stands for a training; found by its name in other processes."""
    print(f"seed {config.seed} speaks")
    if config.seed == 1:
        raise InputError("seed 1 is not to be had")
    if config.seed == 2:
        raise ValueError("broken\nin two lines")
    if config.seed == 3:
        raise SystemExit(130)
    return {"steps": f"{config.seed}00"}


def overrides(tmp_path: Path, launcher: str, *ours: str) -> list[str]:
    out = f"out={tmp_path}/" + "${name}/${seed}"
    limits = {"joblib": ["hydra.launcher.n_jobs=1"], "submitit_local": ["hydra.launcher.timeout_min=5"]}
    return [out, f"hydra.sweep.dir={tmp_path}/sweep", f"hydra/launcher={launcher}", *limits.get(launcher, []), *ours]


def test_each_hand_of_a_sweep_has_a_folder_of_its_own(tmp_path: Path):
    """As many jobs are launched as there are hands, and each is given the folder that was checked beforehand."""
    given = [o for o in overrides(tmp_path, "basic", "hand=human,allegro") if not o.startswith("out=")]
    assert [c.out for c in combinations(given)] == ["outputs/pinch/seed0", "outputs/pinch-allegro/seed0"]
    launched = [outcome.config for outcome in module._launched(module._Job(__name__, "silent"), given)]
    assert [(c.hand, c.out) for c in launched] == [(c.hand, c.out) for c in combinations(given)]


def silent(config: Config) -> Mapping[str, object] | None:
    """Stands for a training that writes nothing."""


def test_all_combinations_in_order():
    configs = combinations(["config=pinch,power", "seed=0,1,2", "ppo.num_envs=8", "hydra/launcher=joblib"])
    assert [(c.name, c.seed) for c in configs] == [(n, s) for n in ("pinch", "power") for s in (0, 1, 2)]
    assert {c.ppo.num_envs for c in configs} == {8}
    assert configs[4].out == "outputs/power/seed1"


def in_another_process(given: list[str]) -> tuple[int, str]:
    """Submitit replaces the process's streams, which pytest has replaced before."""
    program = "import sys; from tests.train.learning.test_sweep import sweep, task; sys.exit(sweep(task, sys.argv[1:]))"
    done = subprocess.run(
        [sys.executable, "-c", program, *given], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    return done.returncode, done.stdout


@pytest.mark.parametrize("launcher", [*LAUNCHERS[:2], pytest.param(LAUNCHERS[2], marks=pytest.mark.slow)])
def test_a_job_that_fails_leaves_the_others_alone(tmp_path: Path, launcher: str):
    status, said = in_another_process(overrides(tmp_path, launcher, "config=pinch", "seed=0,1,2,4"))
    assert status == 1, said
    before, rows = said.split("┏")
    for part in ("000", "400", "seed 1 is", "broken"):
        assert part in rows
    if launcher != "basic":
        folder = tmp_path / "pinch"
        assert (folder / "4" / module.LOG).read_text() == "seed 4 speaks\n"
        assert "in two lines" in (folder / "2" / module.LOG).read_text()
        assert before == "", "jobs beside each other do not speak on the terminal"


@pytest.mark.parametrize("launcher", LAUNCHERS[:2])
def test_a_signal_ends_the_sweep(tmp_path: Path, capsys, monkeypatch, launcher: str):
    monkeypatch.setattr(module, "_stopped", 0)
    assert sweep(task, overrides(tmp_path, launcher, "seed=0,3,4")) == 130
    said = " ".join(capsys.readouterr().out.split())
    assert "stopped" in said
    assert "not started" in said
    assert "400" not in said


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("seed=0,1", "ppo.num_env=8"), "did you mean ppo.num_envs?"),
        (("config=pinch,pich",), "config/pich"),
        (("seed=0,1", "ppo.num_envs=8,9"), "ppo.num_envs is 9"),
        (("ppo.learning_rate=1e-3,1e-4",), "jobs 0 and 1 of the sweep would both write to outputs/pinch/seed0"),
        (("seed=0,1", "distributed.processes=2", "distributed.coordinator=a:1"), "one process each"),
        (("seed=0,1", "hydra/launcher=lsf"), "hydra/launcher/lsf"),
        (("seed=[0,1",), "no viable alternative"),
    ],
)
def test_what_cannot_be_swept_is_refused_before_anything_starts(tmp_path: Path, capsys, given, said):
    with pytest.raises(InputError) as caught:
        sweep(task, [*given, f"hydra.sweep.dir={tmp_path}"])
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "speaks" not in capsys.readouterr().out


def test_slurm_jobs_compose(tmp_path: Path, monkeypatch):
    """Without a cluster, submitit says that there is none, and so does the sweep, in a line."""
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="the launcher gave up") as caught:
        sweep(task, overrides(tmp_path, "submitit_slurm", "seed=0,4", "hydra.launcher.partition=gpu"))
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_trainings_beside_each_other(tiny: Config, tmp_path: Path):
    command = arguments(tiny, tmp_path)
    command = [part for part in command if not part.startswith("out=")]
    swept = ["out=" + str(tmp_path) + "/${seed}", "seed=0,1", f"hydra.sweep.dir={tmp_path}/sweep"]
    launcher = ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]
    done = subprocess.run([*command, "--multirun", *swept, *launcher], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    for seed in "01":
        assert (tmp_path / seed / "best.npz").is_file()
        assert "success" in (tmp_path / seed / module.LOG).read_text()
    assert done.stdout.count("64") == 2, done.stdout
