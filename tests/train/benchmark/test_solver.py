import json

import mujoco
import numpy as np
import pytest

from envs.demonstrations.scripted.trials import draw_scripts
from envs.grasps import grasp_type
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from train.benchmark import solver
from train.benchmark.__main__ import main


@pytest.fixture(scope="module")
def scripts():
    model = load_hand()
    hand = build_rigid_hand(model, np.zeros(model.num_shape))
    return draw_scripts(grasp_type("pinch"), [hand] * 3, np.random.default_rng(1))


def test_the_table_has_a_row_for_each_setting_and_finds_what_must_fail(tmp_path, capsys, monkeypatch):
    names = [solver.CHOSEN, "impratio 1", "2 ms"]
    monkeypatch.setattr(solver, "SWEEP", {name: solver.SWEEP[name] for name in names})
    assert main(["solver", "--grasps", "pinch", "--scripts", "3", "--runs", "2", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert (tmp_path / "solver.md").read_text().strip() in printed
    figures = json.loads((tmp_path / "solver.json").read_text())["grasps"]["pinch"]
    assert list(figures) == names
    for name in names:
        assert printed.count(f"| {name} |") == 2
    chosen, slippery, fine = (figures[name] for name in names)
    assert chosen["held"] > slippery["held"] == 0
    assert slippery["shaking"] is slippery["deepest"] is None
    assert 0 < chosen["mean_depth"] < chosen["deepest"] < 0.005
    assert fine["deviation"] < chosen["deviation"] < slippery["deviation"]
    assert fine["simulated"] < chosen["simulated"]
    np.testing.assert_allclose(chosen["simulated"], 0.004 * chosen["steps"])


def test_settings_are_applied_to_copies(scripts):
    models = [script.model for script in scripts]
    (made, *_) = solver.SWEEP["2 ms, solref 5 ms"].applied(models)
    assert made.opt.timestep == 0.002
    assert (made.geom_solref[:, 0] == 0.005).all()
    assert made.opt.solver == mujoco.mjtSolver.mjSOL_PGS
    assert (models[0].opt.timestep, models[0].geom_solref[0, 0]) == (0.004, 0.01)


def test_depth_is_that_of_the_hand_in_the_object_alone(scripts):
    script = scripts[0]
    state = np.zeros(script.model.nq)
    state[-7:] = script.object_start
    state[:3] = 1.0, 0.0, 1.0  # the hand is far
    state[-5] -= 0.001  # the object stands a millimetre in the table
    assert solver._depths(script.model, state[None]).size == 0


def test_bad_options_end_in_one_line(capsys):
    assert main(["solver", "--scripts", "0"]) == 2
    assert capsys.readouterr().err == "benchmark: 0 scripts, 3 runs; give at least 1 of each\n"
