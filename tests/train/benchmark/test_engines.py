import json
import time

import numpy as np
import pytest
from PIL import Image

from train.benchmark import contestants, engines
from train.benchmark.__main__ import main
from train.benchmark.contestants import Contestant
from train.benchmark.timing import rates
from train.experiment import make_world

TINY = ("--engines", "native", "--worlds", "2", "--runs", "2", "--seconds", "0.01")


@pytest.fixture(scope="module")
def demonstrations(tmp_path_factory):
    """The folder of the benchmark's set, made once for the tests below."""
    return tmp_path_factory.mktemp("demonstrations")


@pytest.fixture(scope="module")
def world(demonstrations):
    return make_world(engines.config("native", demonstrations), "train")


def table(text: str) -> list[list[str]]:
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    assert {len(row) for row in rows} == {len(rows[0])}
    return rows[2:]


def number(cell: str) -> float:
    return float(cell.split(" (")[0].replace(",", ""))


def test_report_is_a_table_with_the_same_figures_in_a_file_and_a_plot(demonstrations, tmp_path, capsys):
    folders = ("--out", str(tmp_path), "--demonstrations", str(demonstrations))
    assert main(["engines", *TINY, *folders]) == 0
    rows = table(capsys.readouterr().out)
    content = json.loads((tmp_path / "engines.json").read_text())
    assert [row[:3] for row in rows] == [
        ["native", "environment", "2"],
        ["native", "physics", "2"],
        ["mujoco.mj_step", "physics", "1"],
        ["mujoco.rollout", "physics", "2"],
    ]
    for row, kept in zip(rows, content["rows"], strict=True):
        rate = kept["control_steps"]
        assert 0 < rate["least"] <= rate["median"] <= rate["greatest"]
        assert number(row[3]) == round(rate["median"])
        assert number(row[4]) == round(5 * rate["median"])  # substeps of 4 ms
        np.testing.assert_allclose(number(row[5]), rate["median"] * 0.02 / kept["worlds"], atol=0.006)
        assert (row[6] == "") == (kept["compile_seconds"] is None) == row[0].startswith("mujoco.")
    assert content["machine"]["cores"] >= 1
    assert content["versions"]["mujoco"]
    with Image.open(tmp_path / "engines.png") as image:
        assert image.format == "PNG"


def test_an_engine_that_is_not_installed_has_a_row_that_says_how(monkeypatch):
    monkeypatch.setattr(engines, "find_spec", lambda name: None)
    here, missing = engines.split(("native", "warp"))
    assert here == ["native"]
    assert missing == {"warp": "not installed; install it with: pip install 'mjx-hand[warp]'"}


def test_engine_alone_and_mujocos_own_ways_reach_the_same_states(world):
    alone = contestants.physics(world.env, 2).advance(contestants.PASS)
    rolled = contestants.open_rollout(world.env, 2, threads=2).advance(contestants.PASS)
    np.testing.assert_allclose(alone, rolled, atol=1e-5)
    assert np.ptp(rolled, axis=0).max() > 1e-3  # worlds start apart
    looped = contestants.step_loop(world.env).advance(contestants.PASS)
    single = contestants.open_rollout(world.env, 1, threads=1).advance(contestants.PASS)
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
        (["--worlds", "0"], "each at least 1"),
        (["--runs", "0"], "give at least 1 run"),
    ],
)
def test_bad_options_end_in_one_line_and_status_2(options, message, capsys):
    assert main(["engines", *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
