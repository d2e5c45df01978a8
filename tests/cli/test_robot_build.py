"""`mjx-hand robot --build`: known hands as MJCF that MuJoCo and MJX open and step."""

import mujoco
import numpy as np
import pytest
from mujoco import mjx

from mjx_hand.cli.main import main
from mjx_hand.robots.robot_hand import known_robots
from tests.robots.urdfs import urdf_of

# Actuated joints, and those that follow others, as the makers count them.
JOINTS = {
    "allegro": (16, 0),
    "leap": (16, 0),
    "shadow": (22, 0),
    "inspire": (6, 6),
    "ability": (6, 4),
    "schunk": (9, 11),
}


def test_every_known_hand_says_where_its_urdf_is():
    assert {*JOINTS, "allegro_left"} == {*known_robots()}


@pytest.mark.parametrize("robot", sorted(JOINTS))
def test_a_known_hand_is_written_and_opened(robot, tmp_path, capsys):
    assert urdf_of(robot).is_file()  # skips without the package that carries it
    options = ["--absent-meshes", "bones"]  # the package has the meshes of few hands
    assert main(["robot", "--robot", robot, "--build", str(tmp_path / robot), *options]) == 0
    said = capsys.readouterr().out
    actuated, tied = JOINTS[robot]
    assert f"{robot}, right: {actuated} actuated joints, {tied} that follow others" in said
    model = mujoco.MjModel.from_xml_path(str(tmp_path / robot / f"{robot}.xml"))
    assert (model.nu, model.neq, model.nq) == (6 + actuated, tied, 6 + actuated + tied)
    assert model.nsensor == len({model.site(k).name for k in range(model.nsite)})
    assert (model.actuator_forcerange[6:, 1] > 0).all()
    model.opt.timestep, model.opt.integrator = 0.004, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.body_gravcomp[:] = 1
    data = mujoco.MjData(model)
    low, high = model.actuator_ctrlrange.T
    data.ctrl[6:] = (low + (high - low) * 0.4)[6:]
    for _ in range(500):
        mujoco.mj_step(model, data)
    joints = model.jnt_qposadr[model.actuator_trnid[6:, 0]]
    assert not any(warning.number for warning in data.warning)
    np.testing.assert_allclose(data.qpos[joints], data.ctrl[6:], atol=0.03)
    placed = mjx.put_model(model)
    assert placed.nu == model.nu


def test_a_hand_of_the_other_side_is_refused(tmp_path, capsys):
    urdf = urdf_of("allegro")
    options = ["robot", "--robot", "allegro", "--urdf", str(urdf), "--side", "left", "--build", str(tmp_path / "o")]
    assert main(options) == 2
    assert "is a right hand; give a left hand's URDF" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["a.npz", "--build", "o"], "--build writes the robot hand itself"),
        (["--build", "o", "--out", "o.npz"], "--build writes the robot hand itself"),
        ([], "give a recording and --out FILE.npz"),
        (["--build", "o", "--urdf", "absent.urdf"], "absent.urdf: no such file"),
    ],
)
def test_options_that_do_not_go_together_end_in_one_line(given, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["robot", "--robot", "allegro", *given]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())
