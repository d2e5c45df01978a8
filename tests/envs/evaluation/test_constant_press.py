import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from envs.evaluation import constant_press as module
from envs.evaluation.constant_press import constant_press, search_press
from envs.evaluation.evaluate import evaluate
from envs.evaluation.roll_out import make_roll_out, zero_residual
from envs.grasps import grasp_type
from envs.grasps.grasp_type import Pads, Wrap
from envs.grip_force import RECORDED, grip_force_of
from envs.scene import NUM_WRIST
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.hand.joints import HINGES
from mjx_hand.pytree import replace

PINCH = grasp_type("pinch")


@pytest.fixture(scope="module")
def press(env):
    return constant_press(env)


def test_pads_press_with_the_reference_s_own_grip(env, press, demonstrations, hands):
    """At the reference's force its controls; at full strength those of an environment that has it as its force."""
    assert isinstance(PINCH.closing, Pads)
    own = press.tables({"pinch": PINCH.grip_force / PINCH.closing.force}).reference
    np.testing.assert_allclose(own.grip, env.reference.grip, atol=2e-5)
    np.testing.assert_allclose(own.controls, env.reference.controls, atol=2e-5)
    task = dataclasses.replace(env.task, grip_force=PINCH.closing.force)
    full = TrackingEnv(demonstrations, hands, "native", task).reference
    found = press.tables({"pinch": 1.0}).reference
    np.testing.assert_allclose(found.grip, full.grip, atol=2e-4)
    np.testing.assert_allclose(found.controls, full.controls, atol=2e-4)
    assert press.described({"pinch": 0.75}) == {"pinch": f"{0.75 * PINCH.closing.force:.3g} N"}


def test_recordings_are_pressed_as_hard_as_their_weight_asks_for(env):
    """No grasp type says how hard. The grid must reach what carries them, or the baseline beside a policy is weak."""
    other = env.with_tables(env.tables)
    other.demonstrations = tuple(replace(d, grasp="recorded") for d in env.demonstrations)
    other.task = dataclasses.replace(env.task, wrap_torque=0.0)  # as experiments of people's recordings have it
    weights = [9.81 * d.object.mass / d.object.friction for d in env.demonstrations]
    assert env.task.grip_force is None
    pressed = constant_press(other)
    full = pressed.full["recorded"]
    assert full == pytest.approx(4 * np.median(weights))
    assert full is not None
    assert max(module.SHARES) * full > 4.5 * max(weights)
    held = np.asarray(pressed.press).any(axis=(1, 2))
    assert held.all()


def test_wraps_close_before_the_object_moves(env, press):
    """A demonstration that is said to be a power grasp: its torques, from none to all in 0.6 s, within the limits."""
    closing = grasp_type("power").closing
    assert isinstance(closing, Wrap)
    other = env.with_tables(env.tables)
    other.demonstrations = tuple(replace(d, grasp="power") for d in env.demonstrations)
    wrapped = constant_press(other)
    assert wrapped.full == {"power": None}
    grip = np.asarray(wrapped.tables({"power": 1.0}).reference.grip)
    hinge = HINGES.index("index_mcp_flexion")
    most = min(closing.finger_torque[0], env.gains.force_limit[hinge]) / env.gains.stiffness[hinge]
    for k, d in enumerate(env.demonstrations):
        away = np.linalg.norm(d.object_pose[:, :3] - d.object_pose[0, :3], axis=1) > 0.002
        cosine = np.abs(d.object_pose[:, 3:] @ d.object_pose[0, 3:])
        turned = 2 * np.arccos(np.minimum(cosine, 1.0)) > np.deg2rad(2.0)
        first = int(np.argmax(away | turned))
        before = max(first - round(0.6 * env.fps), 0)
        np.testing.assert_array_equal(grip[k, : before + 1], 0.0)
        assert (np.diff(grip[k, before : first + 1, NUM_WRIST + hinge]) > 0).all()
        np.testing.assert_allclose(grip[k, first:, NUM_WRIST + hinge], most, rtol=1e-5)
    np.testing.assert_array_equal(grip[..., :NUM_WRIST], 0.0)
    twice = np.asarray(wrapped.tables({"power": 100.0}).reference.grip)
    assert np.abs(twice[..., NUM_WRIST:] * env.gains.stiffness).max() <= env.gains.force_limit.max() + 1e-6
    assert wrapped.described({"power": 0.5}) == {"power": "0.5 × its closing torques"}


def test_the_search_finds_what_trying_each_finds(env, press, monkeypatch):
    shares = (0.01, PINCH.grip_force / 12.0, 0.75)
    monkeypatch.setattr(module, "SHARES", shares)
    roll_out = make_roll_out(env, zero_residual, 5.0)
    monkeypatch.setattr(module, "make_roll_out", lambda *args: roll_out)  # compiled once
    objects = [d.object for d in env.demonstrations]
    judged = []
    for share in shares:
        rows = evaluate(roll_out(None, press.tables({"pinch": share})), objects).rows()
        judged.append(np.mean([rows["chord"], rows["hold"], rows["manip_trans_object"]]))
    found = search_press(env, 5.0)
    assert found == {"pinch": shares[int(np.argmax(judged))]}
    assert max(judged) > judged[0]  # a hand that hardly presses holds nothing


def test_a_type_that_training_lacks_is_pressed_at_full_strength(env, press):
    np.testing.assert_array_equal(press.tables({}).reference.grip, press.tables({"pinch": 1.0}).reference.grip)
    assert not np.array_equal(press.tables({"pinch": 0.5}).reference.grip, press.tables({}).reference.grip)
    assert jnp.isfinite(press.tables({}).reference.controls).all()


def test_a_robots_grip_on_a_recorded_object_is_made_stronger(brought, allegro):
    """No type says how to press it: a quarter of full strength is the reference's own grip, and wraps close with it."""
    d = brought.demonstration
    recorded = replace(d, grasp=RECORDED)
    env = TrackingEnv([recorded], [allegro], "native", Task(contacts="object"))
    made = constant_press(env)
    own = made.tables({RECORDED: 0.25}).reference
    np.testing.assert_allclose(own.grip, env.reference.grip, atol=1e-5)
    stronger = np.abs(np.asarray(made.tables({RECORDED: 0.5}).reference.grip)).sum()
    assert stronger > 1.2 * np.abs(np.asarray(own.grip)).sum()
    assert made.described({RECORDED: 0.25}) == {RECORDED: "1 × the reference's grip"}
    without = constant_press(TrackingEnv([recorded], [allegro], "native", Task(contacts="object", wrap_torque=0.0)))
    weight = grip_force_of(d.object.mass, d.object.friction)
    assert without.described({RECORDED: 0.25}) == {RECORDED: f"{weight:.3g} N"}
