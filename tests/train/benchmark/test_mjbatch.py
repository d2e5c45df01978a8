import json
import os
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from envs.physics import solver
from envs.physics.native import NativeEngine
from mjx_hand.errors import InputError
from train.benchmark import entrants, mjbatch, mjbatch_worker
from train.benchmark.__main__ import main
from train.benchmark.contestants import PASS
from train.benchmark.engines import small_env
from train.benchmark.exchange import make_start, numbers, scene_xml, write_scene, write_script
from train.benchmark.mjbatch_process import MjbatchProcess
from train.benchmark.mjbatch_report import Results, Row, text

PYTHON = os.environ.get("MJX_HAND_MJBATCH_PYTHON")
TINY = ("--worlds", "1", "3", "--rounds", "2", "--seconds", "0.01", "--threads", "2")


@pytest.fixture(scope="module")
def env(demonstrations):
    return small_env("native", "pinch", demonstrations)


@pytest.mark.slow
def test_a_model_comes_out_of_the_files_as_it_went_in(env, tmp_path):
    wanted = solver.gauss_seidel(env.models)
    write_scene(tmp_path, env, {"some": wanted})
    with np.load(tmp_path / "some.npz") as kept:
        fields = dict(kept)
    model, varying, _, unknown = mjbatch_worker.load_model(str(tmp_path / "scene.xml"), fields)
    assert not unknown
    assert {"body_mass", "geom_size", "geom_friction", "site_pos"} <= set(varying)
    assert not any(name.startswith("opt.") for name in varying)
    for name in ("nq", "nv", "nu", "nbody", "ngeom", "nsite", "nsensordata"):
        assert getattr(model, name) == getattr(wanted[0], name)
    kinds = ("body_", "jnt_", "dof_", "geom_", "actuator_", "site_")
    fields = [
        name for name in dir(wanted[0]) if name.startswith(kinds) and isinstance(getattr(model, name), np.ndarray)
    ]
    for name in set(fields) - {"actuator_ctrlspec"}:  # of which MuJoCo 3 cannot be told
        np.testing.assert_array_equal(getattr(model, name), getattr(wanted[0], name), err_msg=name)
    assert (model.opt.solver, model.opt.iterations, model.opt.impratio) == (mujoco.mjtSolver.mjSOL_PGS, 15, 50.0)
    assert (model.opt.cone, model.opt.timestep) == (mujoco.mjtCone.mjCONE_ELLIPTIC, 0.004)


def test_what_another_mujoco_compiles_otherwise_or_does_not_know_is_named(env, tmp_path):
    (tmp_path / "scene.xml").write_text(scene_xml(env))
    fields = numbers(env.models)
    fields["body_mass"] = 2 * fields["body_mass"]
    fields["body_charm"] = np.ones((2, 3))
    model, _, otherwise, unknown = mjbatch_worker.load_model(str(tmp_path / "scene.xml"), fields)
    assert "body_mass" in otherwise
    assert "body_pos" not in otherwise
    assert unknown == ["body_charm"]
    np.testing.assert_array_equal(model.body_mass, fields["body_mass"][0])
    fields["body_mass"] = fields["body_mass"][:, 1:]
    with pytest.raises(ValueError, match="body_mass has shape"):
        mjbatch_worker.load_model(str(tmp_path / "scene.xml"), fields)


def test_bounding_volumes_hold_those_of_all_models(env):
    covering = numbers(env.models)["bvh_aabb"]
    for model, found in zip(env.models, covering, strict=True):
        np.testing.assert_array_equal(found, covering[0])
        corner = model.bvh_aabb[:, :3] + model.bvh_aabb[:, 3:]
        assert (corner <= found[:, :3] + found[:, 3:] + 1e-12).all()
        assert (model.bvh_aabb[:, :3] - model.bvh_aabb[:, 3:] >= found[:, :3] - found[:, 3:] - 1e-12).all()


def test_native_and_mujocos_batch_end_at_the_same_bits(env):
    start = make_start(env, 3)
    engine = NativeEngine(solver.newton(env.models), env.engine.substeps, threads=2)
    ends = [
        entrants.native(engine, start).end(),
        *(entrants.mujoco_batch(engine, start, 2, current).end() for current in (True, False)),
    ]
    for end in ends[1:]:
        np.testing.assert_array_equal(np.float32(end), ends[0])
    assert np.abs(ends[0] - start.qpos).max() > 1e-3


def test_rows_say_how_many_times_as_fast_native_was_in_the_same_round():
    rates = np.array([[[10.0, 5.0], [40.0, 20.0], [20.0, 10.0]], [[5.0, 5.0], [20.0, 5.0], [40.0, 5.0]]])
    ends = [np.zeros((2, 10)), np.zeros((2, 10))]
    ends[1][:, -7] = 1e-6, 3e-6
    native, other = Row.of_all("PGS 15", ["native", "other"], 2, rates, ends)
    assert native.native.least == native.native.greatest == 1
    assert (other.native.median, other.native.least, other.native.greatest) == (2.0, 0.5, 2.0)
    assert (other.native_of_cpu.median, other.steps_of_cpu.median, other.steps.median) == (2.0, 5.0, 20.0)
    np.testing.assert_allclose(other.apart, (2e-6, 3e-6), rtol=1e-6)
    lines = text(Results(rows=[native, other], notes=["a note"], threads=2, theirs={"mjbatch": "0.1.4"}))
    assert "- a note" in lines
    assert "beside it: mjbatch 0.1.4" in lines
    assert lines[-1] == "| PGS 15 | 2 | other | 20 (5 to 40) | 2.00 (0.50 to 2.00) | 5 | 2.00 (1.00 to 4.00) | 2 / 3 |"


def test_without_an_environment_the_report_says_how_to_make_one(demonstrations, tmp_path, capsys):
    folders = ("--out", str(tmp_path), "--demonstrations", str(demonstrations))
    assert main(["mjbatch", *TINY, *folders]) == 0
    printed = capsys.readouterr().out
    assert "mjbatch: not measured; make an environment for it with: python -m venv ENV && ENV/bin/pip" in printed
    content = json.loads((tmp_path / "mjbatch.json").read_text())
    assert [(row["setting"], row["worlds"]) for row in content["rows"][::3]] == [
        (setting, count) for setting in ("PGS 15", "Newton 10") for count in (1, 3)
    ]
    assert {row["name"] for row in content["rows"]} == {
        entrants.NATIVE,
        entrants.MUJOCO_CURRENT,
        entrants.MUJOCO_LATE,
    }
    assert all(row["apart"] == [0.0, 0.0] for row in content["rows"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--worlds", "0"], "each at least 1"),
        (["--rounds", "0"], "give at least 1"),
        (["--threads", "-1"], "threads is -1"),
        (["--python", "/nowhere/python"], "cannot run /nowhere/python: No such file"),
        (["--python", sys.executable], "mjbatch.*make an environment with mjbatch: python -m venv ENV"),
    ],
)
def test_bad_options_end_in_one_line_and_status_2(options, message, capsys):
    assert main(["mjbatch", *options]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    with pytest.raises(InputError, match=message):
        raise InputError(error.strip())


@pytest.mark.skipif(PYTHON is None, reason="MJX_HAND_MJBATCH_PYTHON names no interpreter that mjbatch is installed for")
def test_mjbatch_ends_where_native_ends(env, tmp_path):
    models = {name: setting(env.models) for name, setting in mjbatch._SETTINGS.items()}
    write_scene(tmp_path, env, models)
    start = make_start(env, 6)
    write_script(tmp_path / "script.npz", start, env.engine.substeps)
    with MjbatchProcess(Path(str(PYTHON)), tmp_path) as process:
        assert set(process.versions) == {"mjbatch", "mujoco"}
        for name in models:
            paths = {"scene": "scene.xml", "numbers": f"{name}.npz", "script": "script.npz"}
            otherwise, unknown = process.ask(do="make", name=name, threads=2, forward=True, **paths)
            assert set(otherwise) <= {"site_size"}  # of pictures alone
            assert set(unknown) <= {"jnt_springyield"}
            theirs = entrants.mjbatch(process.ask, name, start, current=True)
            ours = entrants.native(NativeEngine(models[name], env.engine.substeps, threads=2), start)
            np.testing.assert_allclose(theirs.end(), ours.end(), atol=1e-5)
            assert min(theirs.run(PASS)) > 0
        with pytest.raises(InputError, match="stopped: FileNotFoundError"):
            process.ask(do="make", name="none", threads=2, forward=True, scene="", numbers="none.npz", script="")
