"""Trainings that are stopped, killed and damaged end as those that are not."""

import contextlib
import dataclasses
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from omegaconf import OmegaConf

import train.ppo
from envs.rewards import RewardWeights
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from tests.train.commands import arguments
from train.learning.curve import Point
from train.learning.interruption import interruptions
from train.ppo import train as run
from train.settings.config import Config

Trained = tuple[Path, list[Point]]


def in_folder(config: Config, out: Path, **change: Any) -> Config:
    return dataclasses.replace(config, out=str(out), **change)


def shortened(config: Config, steps: int) -> Config:
    return dataclasses.replace(config, ppo=dataclasses.replace(config.ppo, num_timesteps=steps))


def same_results(one: Path, other: Path) -> None:
    for name in ("best.npz", "last.npz"):
        with np.load(one / name) as first, np.load(other / name) as second:
            assert set(first) == set(second)
            for key in first:
                np.testing.assert_array_equal(second[key], first[key], err_msg=f"{name} {key}")
    scores = [
        [line.split(",")[:1] + line.split(",")[2:] for line in (folder / "curve.csv").read_text().splitlines()]
        for folder in (one, other)
    ]
    assert scores[0] == scores[1]


def test_a_training_in_two_parts_is_the_training(trained: Trained, tiny: Config, env: TrackingEnv, tmp_path):
    out, points = trained
    assert [p.steps for p in run(in_folder(shortened(tiny, 32), tmp_path), env)] == [0, 32]
    again = run(in_folder(tiny, tmp_path), env)
    assert [p.steps for p in again] == [p.steps for p in points]
    same_results(out, tmp_path)


def test_a_finished_training_says_so(trained: Trained, tiny: Config, env: TrackingEnv, capsys):
    out, points = trained
    before = (out / "last.npz").stat().st_mtime_ns
    assert [p.steps for p in run(tiny, env)] == [p.steps for p in points]
    assert "is trained already" in capsys.readouterr().out
    assert (out / "last.npz").stat().st_mtime_ns == before


def test_a_signal_stops_between_updates_and_the_rest_follows(
    trained: Trained, tiny: Config, env: TrackingEnv, tmp_path, monkeypatch, capsys
):
    @contextlib.contextmanager
    def after_the_first_update() -> Iterator[Callable[[], int]]:
        calls = iter(range(100))
        yield lambda: signal.SIGTERM if next(calls) else 0

    config = in_folder(dataclasses.replace(tiny, checks=dataclasses.replace(tiny.checks, every=64)), tmp_path)
    with monkeypatch.context() as patched:
        patched.setattr(train.ppo, "interruptions", after_the_first_update)
        with pytest.raises(SystemExit) as stop:
            run(config, env)
    assert stop.value.code == 128 + signal.SIGTERM
    assert "stopped at 32 steps and saved" in capsys.readouterr().out
    assert [p.steps for p in run(config, env)] == [0, 64]
    with np.load(trained[0] / "last.npz") as first, np.load(tmp_path / "last.npz") as second:
        for key in first:
            np.testing.assert_array_equal(second[key], first[key])


def test_signals_are_remembered_and_the_handlers_put_back():
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with interruptions() as asked:
        assert asked() == 0
        signal.raise_signal(signal.SIGTERM)
        assert asked() == signal.SIGTERM
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def test_other_settings_do_not_go_on_but_start_anew_if_told(tiny: Config, env: TrackingEnv, tmp_path):
    short = shortened(in_folder(tiny, tmp_path), 32)
    run(short, env)
    with pytest.raises(InputError, match=r"holds a training with seed=0, now 1; choose another .* fresh=true"):
        run(dataclasses.replace(short, seed=1), env)
    anew = run(dataclasses.replace(short, seed=1, fresh=True), env)
    assert [p.steps for p in anew] == [0, 32]


def test_a_second_training_is_kept_out_and_a_killed_one_keeps_nobody_out(tiny: Config, env: TrackingEnv, tmp_path):
    config = shortened(in_folder(tiny, tmp_path), 32)
    code = "import sys, time, filelock; lock = filelock.FileLock(sys.argv[1]); lock.acquire(); print('has it')"
    command = [sys.executable, "-uc", f"{code}; time.sleep(60)", str(tmp_path / "lock")]
    other = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    with other:
        try:
            assert other.stdout is not None
            assert other.stdout.readline() == "has it\n"
            for fresh in (False, True):
                with pytest.raises(InputError, match=r"another training is under way in .*stop it.*out=FOLDER"):
                    run(dataclasses.replace(config, fresh=fresh), env)
            assert [path.name for path in tmp_path.iterdir()] == ["lock"]
        finally:
            other.kill()
    assert [p.steps for p in run(config, env)] == [0, 32]


def test_a_damaged_state_is_named_and_the_one_before_used(
    trained: Trained, tiny: Config, env: TrackingEnv, tmp_path, capsys
):
    config = in_folder(tiny, tmp_path)
    run(config, env)
    states = sorted((tmp_path / "state").iterdir())
    assert [path.name for path in states] == ["000000000000.npz", "000000000032.npz", "000000000064.npz"]
    content = bytearray(states[-1].read_bytes())
    content[len(content) // 2] ^= 1
    states[-1].write_bytes(content)
    capsys.readouterr()
    run(config, env)
    said = capsys.readouterr().out
    assert "damaged, so the state before it is used" in said
    assert "going on from 32 steps" in said
    same_results(trained[0], tmp_path)
    for path in states:
        path.write_bytes(b"")
    with pytest.raises(InputError, match=r"no sound state in .*; train anew with fresh=true"):
        run(config, env)


def test_what_was_lost_is_made_again_from_the_state(trained: Trained, tiny: Config, env: TrackingEnv, tmp_path):
    config = in_folder(tiny, tmp_path)
    run(config, env)
    whole = {name: (tmp_path / name).read_bytes() for name in ("best.npz", "last.npz", "curve.csv")}
    (tmp_path / "best.npz").unlink()
    (tmp_path / "last.npz").write_bytes(whole["last.npz"][:100])
    (tmp_path / "curve.csv").write_text("steps\nmany\n")
    (tmp_path / "state" / ".000000000064-abcdefgh.npz").touch()  # as a kill leaves them
    (tmp_path / ".last-abcdefgh.npz").touch()
    run(config, env)
    assert {name: (tmp_path / name).read_bytes() for name in whole} == whole
    same_results(trained[0], tmp_path)
    assert not list(tmp_path.rglob(".*"))


def test_states_belong_to_their_settings(tiny: Config, env: TrackingEnv, tmp_path, capsys):
    mine, other = in_folder(tiny, tmp_path / "0"), in_folder(tiny, tmp_path / "1", seed=1)
    run(shortened(mine, 32), env)
    run(other, env)
    shutil.copy(tmp_path / "1" / "state" / "000000000064.npz", tmp_path / "0" / "state")
    capsys.readouterr()
    assert [p.steps for p in run(mine, env)] == [0, 32, 64]
    said = capsys.readouterr().out
    assert "holds a training with seed=1, now 0" in said
    assert "going on from 32 steps" in said


@pytest.mark.parametrize("content", [b"", b"3\n", b"\xff\x00\x93", b"a: &a [*a]\n", b"[" * 5000])
def test_damaged_settings_are_written_anew(tiny: Config, env: TrackingEnv, tmp_path, content, capsys):
    config = shortened(in_folder(tiny, tmp_path), 32)
    run(config, env)
    whole = (tmp_path / "config.yaml").read_text()
    (tmp_path / "config.yaml").write_bytes(content)
    with pytest.raises(InputError, match="seed=0, now 1"):
        run(dataclasses.replace(config, seed=1), env)
    (tmp_path / "config.yaml").write_bytes(content)
    run(config, env)
    assert "damaged, so the settings in the states are used" in capsys.readouterr().out
    assert (tmp_path / "config.yaml").read_text() == whole


def test_what_is_refused_leaves_no_folder(tiny: Config, tmp_path):
    (tmp_path / "file").touch()
    config = in_folder(tiny, tmp_path / "new" / "out", demonstrations=str(tmp_path / "file"))
    with pytest.raises(InputError):
        run(config)
    with pytest.raises(InputError, match="'warp' is not installed"):
        run(dataclasses.replace(config, engine="warp", demonstrations=str(tmp_path / "sets")))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_killed_at_once_it_goes_on(trained: Trained, tiny: Config, tmp_path):
    """SIGKILL, which nothing can catch, as soon as there is a state to go on from."""
    command = arguments(tiny, tmp_path)
    with (tmp_path / "log").open("w") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
        try:
            for _ in range(3000):
                if list(tmp_path.glob("state/[0-9]*.npz")) or process.poll() is not None:
                    break
                time.sleep(0.1)
        finally:
            process.kill()
            process.wait()
    assert process.returncode == -signal.SIGKILL, (tmp_path / "log").read_text()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "going on from" in done.stdout
    same_results(trained[0], tmp_path)


def test_a_folder_from_when_options_had_other_names_is_gone_on_with(tiny: Config, env: TrackingEnv, tmp_path):
    config = in_folder(tiny, tmp_path)
    run(shortened(config, 32), env)
    written = tmp_path / "config.yaml"
    settings = OmegaConf.load(written)
    rewards = settings.task.pop("rewards")
    settings.task.action_cost = rewards.action
    settings.task.lost_at = settings.task.pop("termination_distance")
    settings.task.finger = settings.task.pop("residual_scale_fingers")
    OmegaConf.save(settings, written)
    other = dataclasses.replace(config.task, rewards=RewardWeights(action=0.5))
    with pytest.raises(InputError, match=r"holds a training with task.rewards.action=0.002, now 0.5;"):
        run(dataclasses.replace(config, task=other), env)
    assert [p.steps for p in run(config, env)] == [0, 32, 64]
