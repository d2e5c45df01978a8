import json

import numpy as np

from train.benchmark import convergence
from train.benchmark.__main__ import main
from train.benchmark.engines import small_env
from train.benchmark.solver import CHOSEN


def test_more_sweeps_end_nearer_to_the_solution(demonstrations, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(convergence, "COMPARED", (CHOSEN, "PGS 10", "PGS 30", "Newton 100, sparse"))
    folders = ("--out", str(tmp_path), "--demonstrations", str(demonstrations))
    assert main(["convergence", "--grasps", "pinch", "--worlds", "32", "--runs", "3", *folders]) == 0
    assert (tmp_path / "convergence.md").read_text().strip() in capsys.readouterr().out
    figures = json.loads((tmp_path / "convergence.json").read_text())["grasps"]["pinch"]
    few, chosen, many = (figures[name] for name in ("PGS 10", CHOSEN, "PGS 30"))
    for off in ("object_off", "hinges_off"):
        few_off, chosen_off, many_off = (row[off]["1000 sweeps"] for row in (few, chosen, many))
        assert (np.diff(few_off) > 0).all()
        assert few_off[-1] > many_off[-1] > 0  # neighbours' order is chance: what touches is chaotic
        assert chosen_off[-1] > many_off[-1]
    newton = figures["Newton 100, sparse"]["object_off"]
    assert newton["Newton's"][-1] < many["object_off"]["Newton's"][-1]
    assert all(row["steps"] > 0 for row in figures.values())


def test_moments_are_states_under_way_and_their_targets_jump(demonstrations):
    env = small_env("native", "pinch", demonstrations)
    state, controls = convergence.moments(env, 3)
    assert controls.shape == (12, 26)
    # Four control steps of three worlds: each goes on from where the one before led.
    step = convergence._stepper(env, convergence.Settings())
    again = convergence._ends(step, state, controls).reshape(4, 3, -1)
    np.testing.assert_array_equal(again[:-1], np.asarray(state.qpos).reshape(4, 3, -1)[1:])
    jerks = np.abs(np.diff(np.asarray(controls).reshape(4, 3, 26), 2, axis=0))
    smooth = np.abs(np.diff(np.asarray(env.reference.controls), 2, axis=1))
    assert np.median(jerks) > 5 * np.median(smooth[smooth > 0])


def test_bad_options_end_in_one_line(capsys):
    assert main(["convergence", "--worlds", "0"]) == 2
    assert capsys.readouterr().err == "benchmark: 0 worlds, 5 runs; give at least 1 of each\n"
