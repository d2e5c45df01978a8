import functools
import itertools
import json
import subprocess
import sys
import time
from pathlib import Path

import jax
import numpy as np
import pytest
from PIL import Image

from train.benchmark import contestants, engines
from train.benchmark.__main__ import main
from train.benchmark.contestants import Contestant
from train.benchmark.memory import fitting
from train.benchmark.timing import rates

TINY = ("--grasps", "pinch", "--engines", "native", "--worlds", "1", "2", "--runs", "2", "--seconds", "0.01")


@pytest.fixture(scope="module")
def env(demonstrations):
    return engines.small_env("native", "pinch", demonstrations)


def tables(text: str) -> list[list[list[str]]]:
    """Rows of each table, without its head."""
    found = []
    for block in text.split("\n\n"):
        lines = [line for line in block.splitlines() if line.startswith("|")]
        rows = [
            [cell.strip() for cell in line.strip().removeprefix("|").removesuffix("|").split("|")] for line in lines
        ]
        assert len({len(row) for row in rows}) <= 1
        found += [rows[2:]] if rows else []
    return found


def number(cell: str) -> float:
    return float(cell.split(" (")[0].replace(",", ""))


@pytest.mark.slow
def test_report_is_a_table_with_the_same_figures_in_a_file_and_a_plot(demonstrations, tmp_path, capsys):
    folders = ("--out", str(tmp_path), "--demonstrations", str(demonstrations))
    assert main(["engines", *TINY, *folders]) == 0
    printed = capsys.readouterr().out
    assert (tmp_path / "engines.md").read_text() in printed
    assert "no accelerator: warp and GPU curves not measured" in printed
    summary, rows = tables(printed)
    content = json.loads((tmp_path / "engines.json").read_text())
    assert [row[:4] for row in rows] == [
        ["pinch", "native", "physics", "1"],
        ["pinch", "native", "physics", "2"],
        ["pinch", "native", "environment", "1"],
        ["pinch", "native", "environment", "2"],
        ["pinch", "mujoco.mj_step", "physics", "1"],
        ["pinch", "mujoco.rollout", "physics", "1"],
        ["pinch", "mujoco.rollout", "physics", "2"],
    ]
    for row, kept in zip(rows, content["rows"], strict=True):
        rate = kept["control_steps"]
        assert 0 < rate["least"] <= rate["median"] <= rate["greatest"]
        assert number(row[4]) == round(rate["median"])
        assert number(row[5]) == round(5 * rate["median"])  # substeps of 4 ms
        np.testing.assert_allclose(number(row[6]), rate["median"] * 0.02 / kept["worlds"], atol=0.006)
        assert (row[7] == "") == (kept["compile_seconds"] is None) == row[1].startswith("mujoco.")
        assert (row[8] == "") == (kept["memory"]["host"] is None)
        assert row[9] == ""  # a CPU has no memory of its own
    speed = [number(row[5]) for row in rows]
    share = f"{speed[1] / speed[6]:.2f}"
    best, real_time = f"{max(speed[:2]):,.0f}", f"{number(rows[0][6]):.0f}"
    assert summary == [["pinch", best, "", "", f"{share} to {share} ×", real_time]]
    assert content["machine"]["cores"] >= 1
    assert content["versions"]["mujoco"]
    with Image.open(tmp_path / "engines.png") as image:
        assert image.format == "PNG"


def test_an_engine_that_is_not_installed_has_a_line_that_says_how(monkeypatch):
    monkeypatch.setattr(engines, "find_spec", lambda name: None)
    here, missing = engines.split(("native", "warp"))
    assert here == ["native"]
    assert missing == ["warp: not installed; install it with: pip install 'mjx-hand[warp]'"]


def test_worlds_are_doubled_until_they_do_not_fit():
    def make(worlds: int) -> Contestant:
        if worlds > 8:
            raise jax.errors.JaxRuntimeError("RESOURCE_EXHAUSTED: Out of memory while trying to allocate")
        return Contestant("mjx", "physics", worlds, None, lambda steps: None)

    fitted = [fitting(functools.partial(make, count)) for count in itertools.islice(engines._counts([1, 4], True), 4)]
    assert [c and c.worlds for c in fitted] == [1, 4, 8, None]
    assert list(engines._counts([1, 4], False)) == [1, 4]

    def faulty() -> Contestant:
        raise jax.errors.JaxRuntimeError("INTERNAL: another fault")

    with pytest.raises(jax.errors.JaxRuntimeError, match="another fault"):
        fitting(faulty)


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="Linux alone tells a process its peak")
def test_memory_is_the_peak_while_a_contestant_is_made_and_run():
    code = """
import numpy as np
from train.benchmark.contestants import Contestant
from train.benchmark.memory import with_memory

def make():
    np.ones(40 * 2**17)  # 40 MiB, given up again
    return Contestant("some", "physics", 1, None, lambda steps: None)

print(with_memory(make).memory.host)
"""
    # A process of its own: in one that has run other tests, memory is given back to the system at any time.
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 35 * 2**20 < int(done.stdout) < 80 * 2**20


def test_engine_alone_and_mujocos_own_ways_reach_the_same_states(env):
    alone = contestants.physics(env, 2).advance(contestants.PASS)
    rolled = contestants.open_rollout(env, 2, threads=2).advance(contestants.PASS)
    np.testing.assert_allclose(alone, rolled, atol=1e-5)
    assert np.ptp(rolled, axis=0).max() > 1e-3  # worlds start apart
    looped = contestants.step_loop(env).advance(contestants.PASS)
    single = contestants.open_rollout(env, 1, threads=1).advance(contestants.PASS)
    np.testing.assert_allclose(looped, single, atol=1e-6)


def test_contestants_take_turns_and_run_whole_units():
    turns = []

    def contestant(name: str, unit: int) -> Contestant:
        def advance(steps: int) -> None:
            turns.append((name, steps))
            time.sleep(1e-4 * steps)

        return Contestant(name, "physics", 3, None, advance, unit)

    quick, slow = rates([contestant("quick", 1), contestant("slow", 40)], runs=3, seconds=0.02)
    timed = turns[-6:]
    assert [name for name, _ in timed] == 3 * ["quick", "slow"]
    assert all(steps % 40 == 0 for name, steps in timed if name == "slow")
    assert len({steps for _, steps in timed}) <= 2
    for rate in (quick, slow):
        assert rate.least <= rate.median <= rate.greatest < 3e4  # 3 worlds, at least 0.1 ms a step
        assert rate.median > 1e4


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--engines", "bullet"], "engine 'bullet' is not known; valid: native, mjx, warp"),
        (["--grasps", "fist"], "fist"),
        (["--worlds", "0"], "each at least 1"),
        (["--runs", "0"], "give at least 1 run"),
    ],
)
def test_bad_options_end_in_one_line_and_status_2(options, message, capsys):
    assert main(["engines", *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
