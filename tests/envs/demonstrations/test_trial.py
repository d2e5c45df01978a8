"""Grasps of an Allegro hand, tried in simulation."""

import dataclasses

import numpy as np
import pytest

from envs.demonstrations.on_robot import robot_set, trial
from envs.demonstrations.on_robot.robot_scene import RobotScene
from envs.demonstrations.on_robot.trial import Rehearsal, rehearse, slip, trial_task
from envs.evaluation.metrics import position_error, rotation_error
from envs.evaluation.roll_out import make_roll_out, zero_residual
from envs.grasps import grasp_type
from envs.grip_force import RECORDED, grip_force_of
from envs.grip_table import default_grip_force, grip_forces
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from mjx_hand.files import array_cache
from mjx_hand.pytree import replace

FORCE = 12.0  # N, with which demonstrations of pinches are made


def test_the_force_is_that_of_the_demonstrations(demonstrations):
    """Of a person's pinch the reference has less, to which a policy adds."""
    d = demonstrations[1]
    assert default_grip_force(d, robot=True) == FORCE
    assert default_grip_force(d, robot=False) == grasp_type("pinch").grip_force < FORCE
    for robot in (True, False):
        assert default_grip_force(replace(d, grasp="power"), robot=robot) == grasp_type("power").grip_force
        weight = grip_force_of(d.object.mass, d.object.friction)
        assert default_grip_force(replace(d, grasp=RECORDED), robot=robot) == weight
        assert default_grip_force(replace(d, grasp="mine"), robot=robot) == weight
    assert trial_task(replace(d, grasp=RECORDED)) == Task(grip_force=weight, contacts="object")
    assert trial_task(d) == Task(grip_force=FORCE)


def test_a_robots_reference_presses_as_its_grasps_were_tried(demonstrations, hands, allegro, brought):
    assert grip_forces([brought.demonstration], [allegro], None) == [FORCE]
    assert grip_forces([brought.demonstration], [allegro], 3.0) == [3.0]
    assert grip_forces([demonstrations[1]], [hands[1]], None) == [grasp_type("pinch").grip_force]


def test_a_grasp_slips_less_than_an_open_hand(demonstrations, hands, allegro, brought):
    """A weight that pulls for 0.4 s falls 78 cm where nothing holds, which is how far what is not touched goes."""
    scene = RobotScene(demonstrations[1], hands[1], allegro)
    held = slip(scene, brought.grasp.targets)
    away = brought.grasp.targets.copy()
    away[:3] += 0.5
    assert held < 0.02  # with the cones of contacts as MuJoCo has them by default it slips farther
    # The table stops one of the six falls; the other five are free.
    assert slip(scene, away) == pytest.approx(5 / 6 * 9.81 * 0.4**2 / 2, rel=0.1)


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
    assert rehearsal.score < brought.rehearsal.score


def test_what_diverges_holds_nothing(demonstrations, hands, allegro, brought, monkeypatch, tmp_path):
    """The engine starts over by itself, and the object would seem to be near its start."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log there
    scene = RobotScene(demonstrations[1], hands[1], allegro)
    monkeypatch.setattr(trial, "_GRAVITY", 1e15)
    assert slip(scene, brought.grasp.targets) == np.inf
    monkeypatch.setattr(trial, "_LOST", np.inf)
    pose = brought.demonstration.object_pose.copy()
    pose[0, 2] = 1e12
    assert rehearse(replace(brought.demonstration, object_pose=pose), allegro).until == 1 / len(pose)


def test_frames_that_fit_no_control_step_are_refused(brought, allegro):
    d = brought.demonstration
    with pytest.raises(InputError, match="at 30 frames/s do not fit control steps of 20 ms"):
        rehearse(replace(d, motion=replace(d.motion, fps=30.0)), allegro)


def test_objects_that_are_lost_in_rehearsal_are_told(demonstrations, hands, allegro, brought, monkeypatch, capsys):
    """And stay in the set: a policy may hold them."""
    outcomes = iter([Rehearsal(0.7, 0.1, 0.2), Rehearsal(1.0, 0.09, 0.2)])
    monkeypatch.setattr(
        robot_set, "on_robot", lambda d, person, body: dataclasses.replace(brought, rehearsal=next(outcomes))
    )
    monkeypatch.setattr(robot_set, "cached", lambda compute, *ingredients: compute())
    made = robot_set.robot_demonstrations(demonstrations[:2], hands[:2], allegro)
    assert len(made) == 2
    assert "allegro: without a policy 1 of 2 objects of pinch are lost on the way" in capsys.readouterr().out


def test_an_interrupted_set_goes_on_where_it_was(demonstrations, hands, allegro, brought, monkeypatch, tmp_path):
    asked = []

    def on_robot(d, person, body):  # type: ignore[no-untyped-def]
        asked.append(d)
        if len(asked) == 2:
            raise KeyboardInterrupt
        return brought

    monkeypatch.setattr(robot_set, "on_robot", on_robot)
    monkeypatch.setattr(array_cache, "_cache", lambda: str(tmp_path))
    with pytest.raises(KeyboardInterrupt):
        robot_set.robot_set(demonstrations[:2], hands[:2], allegro)
    made = robot_set.robot_set(demonstrations[:2], hands[:2], allegro)
    assert [id(d) for d in asked] == [id(demonstrations[k]) for k in (0, 1, 1)]
    assert list(made.done) == [0, 1]
    np.testing.assert_array_equal(made.done[0].motion.angles, brought.demonstration.motion.angles)
    assert made.rehearsals[0] == brought.rehearsal
