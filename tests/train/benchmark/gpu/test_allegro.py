import importlib.util

import mujoco
import numpy as np
import pytest

from mjx_hand.errors import InputError
from train.benchmark.gpu import allegro


@pytest.fixture(scope="module")
def model():
    pytest.importorskip("dexi_rs", reason="dexi-rs is not installed")
    return allegro.allegro_model()


def meet(model, one, other):
    """Whether geoms of these two bodies can be in contact: `mj_collision`'s own rules, for hands in any posture."""
    bodies = sorted(model.body(name).id for name in (one, other))
    signature = (bodies[0] << 16) + bodies[1]
    parents = {int(model.body_weldid[model.body_parentid[model.body_weldid[b]]]) for b in bodies}
    family = {int(model.body_weldid[b]) for b in bodies} & parents and 0 not in model.body_weldid[bodies]
    return signature not in model.exclude_signature and not family


def test_settings_are_those_published(model):
    option = model.opt
    assert option.timestep == pytest.approx(1 / 6000)
    assert allegro.SUBSTEPS == 10
    assert allegro.COMMANDS == 300
    assert option.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert option.solver == mujoco.mjtSolver.mjSOL_NEWTON
    assert option.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert (option.iterations, option.ls_iterations) == (100, 10)
    np.testing.assert_array_equal(model.actuator_gainprm[:, 0], 150.0)
    np.testing.assert_array_equal(model.actuator_biasprm[:, 1:3], np.tile([-150.0, -5.0], (16, 1)))
    assert (model.nq, model.nv, model.nu) == (23, 22, 16)
    # Targets act on the hinges in order, as they stand in qpos.
    np.testing.assert_array_equal(model.jnt_dofadr[model.actuator_trnid[:, 0]], np.arange(16))


def test_fingers_can_meet_each_other_the_palm_and_the_cube(model):
    assert (model.geom_contype & model.geom_conaffinity & 1).all()
    for one, other in (
        ("link_3.0", "link_7.0"),
        ("link_3.0_tip", "link_15.0_tip"),
        ("link_3.0_tip", "base_link"),
        ("link_15.0", "cube"),
        ("base_link", "cube"),
    ):
        assert meet(model, one, other), (one, other)
    for one, other in (("base_link", "link_0.0"), ("base_link", "link_12.0"), ("link_1.0", "link_2.0")):
        assert not meet(model, one, other), (one, other)


def test_fingers_that_are_crossed_are_in_contact(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    for bent in ("joint_1.0", "joint_5.0"):
        data.joint(bent).qpos = 1.4
    data.joint("joint_0.0").qpos, data.joint("joint_4.0").qpos = -0.47, 0.47  # towards each other
    mujoco.mj_forward(model, data)
    names = {model.body(model.geom_bodyid[geom]).name for geom in data.contact.geom.ravel()}
    assert any(name.startswith(("link_1.0", "link_2.0", "link_3.0")) for name in names)
    assert any(name.startswith(("link_5.0", "link_6.0", "link_7.0")) for name in names)


def test_the_c_engine_steps_it_with_the_published_effort(model):
    """Newton reports 1.18 iterations a step on its own scene."""
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    iterations, rows = [], []
    for _ in range(6):
        mujoco.mj_resetData(model, data)
        for _ in range(allegro.COMMANDS):
            data.ctrl = rng.uniform(-1, 1, model.nu)
            for _ in range(allegro.SUBSTEPS):
                mujoco.mj_step(model, data)
                iterations.append(data.solver_niter[0])
                rows.append(data.nefc)
        assert not data.warning.number.any()
        assert np.isfinite(data.qpos).all()
        # The cube falls towards the palm, whose normal is x, and no further than the ground.
        assert -0.5 < data.body("cube").xpos[0] < 0.2
    assert 0.9 < np.mean(iterations) < 1.6
    assert 2 < np.mean(rows) < max(rows) < 64


def test_where_the_hand_is_not_installed_it_is_said_how(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"dexi-rs.*is not installed: pip install dexi-rs==0\.4\.1"):
        allegro.allegro_model()
