"""Where links and object are nearest, also where they just touch, and which point of a link comes first."""

import mujoco
import numpy as np
import pytest

from envs.model_grip import Touch
from mjx_hand.bodies.body import Body, ContactGeom
from mjx_hand.rigid.gains import Gains

_SHAPES = {
    "sphere": "type='sphere' size='0.01'",
    "capsule": "type='capsule' size='0.01 0.02'",
    "box": "type='box' size='0.01 0.02 0.03'",
    "cylinder": "type='cylinder' size='0.01 0.02'",
}


def touch_of(shape: str, turn: str = "1 0 0 0") -> Touch:
    """A link that slides along x, and a cube of 4 cm at the origin."""
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><body name='tip' quat='{turn}'><joint name='j' type='slide' axis='1 0 0'/>
        <geom name='skin' {shape}/></body>
        <body name='object'><freejoint/><geom type='box' size='0.02 0.02 0.02'/></body></worldbody></mujoco>"""
    )
    body = Body(
        name="finger",
        side="right",
        fingers=("thumb",),
        opposing=("thumb",),
        joints=(),
        coupled=(),
        tree_joints=(),
        links=("tip",),
        palm=(0, 0, 0),
        contacts=(ContactGeom("skin", "tip", "thumb"),),
        gains=Gains(),
        build=lambda gains, visual: mujoco.MjSpec(),
    )
    return Touch(model, body)


@pytest.mark.parametrize("away", [0.005, 1e-9, 0.0, -1e-9, -0.002])
def test_a_link_that_just_touches_is_near_and_knows_the_way_in(away):
    touch = touch_of(_SHAPES["sphere"])
    touch.place(np.array([-0.03 - away]), np.array([0, 0, 0, 1.0, 0, 0, 0]))
    ((number, gap, point, way),) = touch.nearest()
    assert number == 0
    assert gap == pytest.approx(away, abs=1e-8)
    np.testing.assert_allclose(way, [1, 0, 0], atol=1e-3)
    np.testing.assert_allclose(point, [-0.02 - away, 0, 0], atol=1e-5)


@pytest.mark.parametrize(("shape", "wanted"), [("sphere", 0.01), ("capsule", 0.03), ("box", 0.03), ("cylinder", 0.02)])
def test_the_foremost_point_of_a_shape_that_lies_along_x(shape, wanted):
    touch = touch_of(_SHAPES[shape], turn="0.70710678 0 0.70710678 0")  # its z along x
    touch.place(np.zeros(1), np.array([1.0, 0, 0, 1.0, 0, 0, 0]))
    assert touch.foremost(0, np.array([1.0, 0, 0]))[0] == pytest.approx(wanted, abs=1e-6)
