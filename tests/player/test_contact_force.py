import mujoco
import numpy as np
import pytest

from mjx_hand.player.contact_force import (
    add_contact_sensors,
    contact_columns,
    position_columns,
    sensed_bodies,
    stop_contact_sensors,
)

SCENE = """
<mujoco>
  <option timestep="0.002" cone="elliptic"/>
  <worldbody>
    <body name="left" pos="-0.1 0 0"><geom type="box" size="0.02 0.1 0.01"/></body>
    <body name="right" pos="0.1 0 0"><geom type="box" size="0.02 0.1 0.01"/><site name="mark"/></body>
    <body name="apart" pos="0 0 -1"><geom type="box" size="0.02 0.1 0.01"/></body>
    <body name="object" pos="0 0 0.03"><freejoint/>
      <geom type="box" size="0.2 0.02 0.02" mass="0.2"/><geom type="sphere" size="0.01" pos="0.05 0 0.03" mass="0.1"/>
    </body>
  </worldbody>
  <sensor><framepos name="mark" objtype="site" objname="mark"/></sensor>
</mujoco>
"""


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(SCENE)
    add_contact_sensors(spec, ("left", "right", "apart"), "object")
    return spec.compile()


def test_supports_carry_a_beam_by_the_law_of_the_lever(model):
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 1000)
    left, right, apart = data.sensordata[contact_columns(model)]
    share = 0.1 * 0.05 / 0.3 / 0.2  # of the weight, that its centre's place puts on the right-hand side
    weight = 0.3 * 9.81
    np.testing.assert_allclose(left[:3], [0, 0, weight * (0.5 - share)], atol=0.02)
    np.testing.assert_allclose(right[:3], [0, 0, weight * (0.5 + share)], atol=0.02)
    assert -0.12 <= left[3] <= -0.08
    assert 0.08 <= right[3] <= 0.12
    np.testing.assert_allclose([left[5], right[5]], 0.01, atol=1e-3)
    np.testing.assert_array_equal(apart, 0.0)


def test_columns_are_of_forces_or_of_positions(model):
    assert contact_columns(model).shape == (3, 6)
    np.testing.assert_array_equal(position_columns(model), [0, 1, 2])
    names = [[model.body(b).name for b in pair] for pair in sensed_bodies(model)]
    assert names == [["left", "object"], ["right", "object"], ["apart", "object"]]


def test_stopped_sensors_leave_the_others_and_the_motion(model):
    spec = mujoco.MjSpec.from_string(SCENE)
    add_contact_sensors(spec, ("left",), "object")
    stopped = spec.compile()
    stop_contact_sensors(stopped)
    one, other = mujoco.MjData(model), mujoco.MjData(stopped)
    mujoco.mj_step(model, one, 50)
    mujoco.mj_step(stopped, other, 50)
    np.testing.assert_array_equal(one.qpos, other.qpos)
    assert stopped.nsensordata == 9
    np.testing.assert_array_equal(other.sensordata[:3], one.sensordata[:3])
    assert contact_columns(stopped).size == 0
