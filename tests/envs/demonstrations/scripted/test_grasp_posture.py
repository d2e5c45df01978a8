import mujoco
import numpy as np
import pytest

from envs.demonstrations.scripted.trials import draw_scripts
from envs.grasps import grasp_names, grasp_type
from envs.scene import NUM_WRIST
from mjx_hand.hand.joints import FINGERS
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand


@pytest.fixture(scope="module")
def people():
    rng = np.random.default_rng(11)
    return [build_rigid_hand(load_hand(), shape=rng.normal(size=10)) for _ in range(3)]


def overlaps(model: mujoco.MjModel, data: mujoco.MjData) -> list[float]:
    """How deep (m) fingers are in each other, and the hand in table and support."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)

    def finger(geom: int) -> str | None:
        return next((name for name in FINGERS if model.geom(geom).name.startswith(name)), None)

    pairs = zip(data.contact.geom, data.contact.dist, strict=True)
    met = [(finger(a), finger(b), -distance) for (a, b), distance in pairs]
    return [depth for one, other, depth in met if one and other and one != other]


@pytest.mark.parametrize("name", grasp_names())
def test_closed_fingers_leave_each_other_room(people, name):
    """Every person finds a posture, and no finger of it is in another: what is performed is what a hand can do."""
    scripts = draw_scripts(grasp_type(name), people, np.random.default_rng(2))
    assert len(scripts) == len(people)
    for script in scripts:
        data = mujoco.MjData(script.model)
        data.qpos[NUM_WRIST:-7] = script.motion.closed_angles
        data.qpos[:3] = script.base.T @ script.motion.position
        data.qpos[-7:] = script.object_start
        assert script.model.npair > 0  # the performer's hand meets itself
        assert max(overlaps(script.model, data), default=0.0) < 0.001
