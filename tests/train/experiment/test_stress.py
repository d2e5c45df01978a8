"""A stress test of a tiny policy: few rows, all that is written of them."""

import csv
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from envs.disturbances import Randomize
from envs.evaluation.evaluate import Evaluation
from train.evaluate import evaluate_and_write
from train.experiment import stress as module
from train.experiment.stress import CURVES, HALF, RECORDED, ROWS, Stress
from train.learning.curve import Point
from train.reports import stress_table as reports
from train.reports.stress_table import stress_figure, stress_table
from train.settings.config import Config, compose

FEW = {RECORDED: ROWS[RECORDED], "moved 40 mm": ROWS["moved 40 mm"]}
CURVE = {"moved (mm)": {0.0: RECORDED, 40.0: "moved 40 mm"}}


@pytest.fixture(autouse=True)
def few_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "ROWS", FEW)
    monkeypatch.setattr(reports, "CURVES", CURVE)


def test_every_row_changes_what_its_name_says():
    usual = Randomize.only()
    changed = {
        row: {f.name for f in dataclasses.fields(Randomize) if getattr(given, f.name) != getattr(usual, f.name)}
        for row, given in ROWS.items()
    }
    assert changed.pop(RECORDED) == set()
    assert "share" in changed.pop(HALF)
    for row, names in changed.items():
        words = {"seen_move": "seen", "seen_turn_deg": "seen", "delay": "late", "move": "moved"}
        assert names, row
        for name in names:
            assert words.get(name, name) in row
            low, high = getattr(ROWS[row], name)
            assert low == high
    assert {row for places in CURVES.values() for row in places.values()} <= set(ROWS)


@pytest.mark.slow
def test_the_page_the_files_and_the_table_say_the_same(tiny: Config, trained: tuple[Path, list[Point]], tmp_path):
    out, _ = trained
    config = dataclasses.replace(tiny, checkpoint=str(out / "best.npz"), out=str(tmp_path), stress=True)
    folder, tables = evaluate_and_write([config])
    content = json.loads((folder / "stress.json").read_text())
    assert list(content["rows"]) == list(FEW)
    with (folder / "stress.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(FEW) * 2  # one demonstration; the policy and the press
    page = (folder / "evaluation.html").read_text()
    assert "Under disturbances" in page
    table = tables[-1]
    assert [row[0] for row in table.rows] == list(FEW)
    for row in table.rows:
        for column, place in (("policy", 1), ("constant press", 3)):
            told = content["rows"][row[0]][column]
            (one,) = [r for r in rows if r["row"] == row[0] and r["column"] == column]
            assert row[place].startswith(f"{100 * told['kept']:.1f} (")
            assert told["kept"] == float(one["chord"] == one["hold"] == "1")
            assert told["chord"] == float(one["chord"])


def test_intervals_are_wilsons():
    def scored(successes: int) -> Evaluation:
        chord = np.arange(10) < 9
        hold = np.arange(10) < successes
        scores = {"chord": chord, "hold": hold, "kept": chord & hold, "manip_trans_object": chord}
        return Evaluation(np.zeros(10, int), scores, ("",) * 10)

    policies, press = {row: {0: scored(8), 1: scored(8)} for row in FEW}, {row: scored(0) for row in FEW}
    found = Stress(policies, press, {"pinch": "9 N"}, "as recorded", "sealed")
    z, n, share = 1.959964, 20, 0.8  # Wilson 1927, of both seeds' rollouts together
    centre, half = share + z**2 / (2 * n), z * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    low, high = ((centre + sign * half) / (1 + z**2 / n) for sign in (-1, 1))
    table = stress_table(found)
    assert table.rows[0][1:] == ("80.0 (58 to 92)", "90.0 / 80.0 / 90.0", "0.0 (0 to 28)", "90.0 / 0.0 / 90.0")
    assert (round(100 * low), round(100 * high)) == (58, 92)
    assert "as recorded: pinch 9 N" in table.note
    assert "10 demonstrations of the sealed part" in table.note
    figure = stress_figure(found)
    assert [axes.get_xlabel() for axes in figure.axes] == ["moved (mm)"]
    policy, press = figure.axes[0].lines
    np.testing.assert_allclose(np.asarray(policy.get_xydata()), [[0, 80], [40, 80]])
    np.testing.assert_allclose(np.asarray(press.get_xydata()), [[0, 0], [40, 0]])


def test_options_reach_the_ranges():
    config = compose(["config=pinch", "randomize.share=0.5", "randomize.mass=[0.5,3]", "randomize.delay=[0,1]"])
    assert config.randomize == Randomize(share=0.5, mass=(0.5, 3.0), delay=(0, 1))
