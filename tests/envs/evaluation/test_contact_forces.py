"""What rollouts tell about the forces on the object: metrics, arrows, and what they cost."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.evaluation.contact_arrows import PER_NEWTON, contact_arrows
from envs.evaluation.evaluate import evaluate
from envs.evaluation.metrics import grip_force
from envs.evaluation.roll_out import make_roll_out, zero_residual
from envs.grip_force import least_contact_force
from envs.rewards import RewardWeights
from envs.scene import OBJECT
from envs.task import Task
from envs.tracking import TrackingEnv
from tests.envs.lifts import CUBE, lift


@pytest.fixture(scope="module")
def gripping(demonstrations, hands):
    return TrackingEnv(demonstrations, hands, "native", Task(grip_force=8.0, rewards=RewardWeights(grip_force=0.5)))


@pytest.fixture(scope="module")
def rollouts(gripping):
    return make_roll_out(gripping, zero_residual, hold=2.0)(None)


def pressed(force: float):
    """A lift in which a thumb and a finger press against each other with this force (N)."""
    rollouts = lift()
    contact = np.zeros_like(rollouts.contact)
    contact[..., 3, :] = [force, 0, 0, -0.02, 0, 0.05]
    contact[..., 15, :] = [-force, 0, 0, 0.02, 0, 0.05]
    return dataclasses.replace(rollouts, contact=contact, least_force=np.array([4.0]))


def test_both_sides_of_a_grip_count():
    scores = evaluate(pressed(6.0), [CUBE]).scores
    assert scores["grip_force_newton"] == pytest.approx(12.0)
    assert scores["grip_force_ratio"] == pytest.approx(3.0)


def test_arrows_end_where_links_touch():
    arrows = contact_arrows(pressed(6.0), 0, np.array([0, 5]))
    assert arrows.shape == (2, 16, 2, 3)
    drawn = np.asarray(np.isfinite(arrows).all(axis=(2, 3)))
    np.testing.assert_array_equal(np.flatnonzero(drawn[1]), [3, 15])
    np.testing.assert_allclose(arrows[1, 3], [[-0.02 - 6 * PER_NEWTON, 0, 0.05], [-0.02, 0, 0.05]])


def test_no_grip_that_carries_is_weaker_than_the_least(gripping, rollouts):
    """Of the frames in which the object is off the ground and moves evenly."""
    np.testing.assert_allclose(rollouts.least_force, [least_contact_force(m) for m in gripping.models], rtol=1e-6)
    model = gripping.models[0]
    mass, friction = model.body(OBJECT).mass[0], float(gripping.demonstrations[0].object.friction)
    assert rollouts.least_force[0] == pytest.approx(9.81 * mass / np.sin(np.arctan(friction)))
    height = rollouts.object_pose[..., 2] - rollouts.object_pose[:, :1, 2]
    speed = np.gradient(rollouts.object_pose[..., :3], 1 / rollouts.fps, axis=1)
    even = np.linalg.norm(np.gradient(speed, 1 / rollouts.fps, axis=1), axis=-1) < 0.3
    carried = rollouts.counted & (height > 0.03) & even
    assert carried.sum() > 20
    assert (grip_force(rollouts) / rollouts.least_force[:, None])[carried].min() > 0.9


def test_a_held_object_is_carried_by_the_forces_on_it(gripping, rollouts):
    """In the last second, in which the hand stands still, they sum to its weight, upwards."""
    still = slice(-round(rollouts.fps), None)
    raised = rollouts.object_pose[:, -1, 2] - rollouts.object_pose[:, 0, 2] > 0.05
    assert raised.any()
    for k in np.flatnonzero(raised):
        weight = 9.81 * gripping.demonstrations[rollouts.demonstration[k]].object.mass
        total = rollouts.contact[k, still, :, :3].sum(axis=1).mean(axis=0)
        np.testing.assert_allclose(total, [0, 0, weight], atol=0.03 * weight)


def test_force_beyond_what_the_weight_needs_costs(gripping, rollouts):
    state = jax.jit(gripping.start)(jnp.asarray(0, jnp.int32), jnp.asarray(150, jnp.int32))
    state = jax.jit(gripping.step)(state, jnp.zeros(26))
    total = np.linalg.norm(np.asarray(state.pipeline_state.physics.contact)[:, :3], axis=-1).sum()
    assert total > rollouts.least_force[0]
    assert float(state.metrics["reward/grip_force"]) == pytest.approx(
        -0.5 * (total / rollouts.least_force[0] - 1), rel=1e-3
    )
