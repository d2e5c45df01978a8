"""Grasps of an Allegro hand, tried in simulation."""

import dataclasses

import numpy as np
import pytest

from envs.demonstrations.on_robot.bring import on_robot
from envs.demonstrations.on_robot.robot_scene import RobotScene
from envs.demonstrations.on_robot.trial import pressing_force, rehearse, slip
from envs.evaluation.metrics import position_error, rotation_error
from envs.evaluation.roll_out import make_roll_out, zero_residual
from envs.grasps import grasp_type
from envs.grip_force import RECORDED, grip_force_of
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.bodies.robot_body import robot_body
from mjx_hand.pytree import replace
from tests.robots.urdfs import urdf_of

FORCE = 12.0  # N, with which demonstrations of pinches are made


@pytest.fixture(scope="module")
def allegro():
    assert urdf_of("allegro").is_file()  # skips without the package that carries it
    return robot_body("allegro")


@pytest.fixture(scope="module")
def brought(demonstrations, hands, allegro):
    return on_robot(demonstrations[1], hands[1], allegro)


def test_the_force_is_that_of_the_demonstrations(demonstrations):
    d = demonstrations[1]
    assert pressing_force(d) == FORCE
    assert pressing_force(replace(d, grasp="power")) == grasp_type("power").grip_force
    recorded = replace(d, grasp=RECORDED)
    assert pressing_force(recorded) == grip_force_of(d.object.mass, d.object.friction)


def test_a_grasp_slips_less_than_an_open_hand(demonstrations, hands, allegro, brought):
    """A weight that pulls for 0.4 s falls 78 cm where nothing holds, which is how far what is not touched goes."""
    scene = RobotScene(demonstrations[1], hands[1], allegro)
    gravity = scene.model.opt.gravity.copy()
    held = slip(scene, brought.grasp.targets)
    away = brought.grasp.targets.copy()
    away[:3] += 0.5
    assert held < 0.05
    # The table stops one of the six ways; the other five are free.
    assert slip(scene, away) == pytest.approx(5 / 6 * 9.81 * 0.4**2 / 2, rel=0.1)
    np.testing.assert_array_equal(scene.model.opt.gravity, gravity)


def test_a_rehearsal_is_what_the_environment_does(brought, allegro):
    """The same demonstration with the same press under a policy that does nothing, by the environment's own engine."""
    task = Task(grip_force=FORCE)
    env = TrackingEnv([brought.demonstration], [allegro], "native", task)
    rolled = make_roll_out(env, zero_residual, 0.0)(None, env.tables)
    assert brought.rehearsal.until == 1.0
    # Both simulate contacts in single steps of 4 ms, but one in JAX's single precision: 1 mm and 1 degree apart.
    assert brought.rehearsal.moved == pytest.approx(position_error(rolled)[rolled.counted].max(), abs=0.001)
    assert brought.rehearsal.turned == pytest.approx(rotation_error(rolled)[rolled.counted].max(), abs=0.02)


def test_an_object_of_ice_is_lost_on_the_way(brought, allegro):
    d = brought.demonstration
    ice = replace(d, object=dataclasses.replace(d.object, friction=0.02))
    rehearsal = rehearse(ice, allegro)
    assert 0.1 < rehearsal.until < 0.9
    assert rehearsal.moved > 0.1
    assert rehearsal.goodness < brought.rehearsal.goodness
