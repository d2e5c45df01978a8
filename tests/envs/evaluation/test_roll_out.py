import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.evaluation.roll_out import make_roll_out, zero_residual
from mjx_hand.hand.joints import FINGERS, LINKS

HOLD = 1.0


@pytest.fixture(scope="module")
def rollouts(env, hands):
    return make_roll_out(env, zero_residual, hold=HOLD)(None)


def test_masks_count_the_demonstration_and_then_the_hold(env, rollouts):
    length = np.asarray(env.reference.length)
    np.testing.assert_array_equal(rollouts.counted.sum(axis=1), length)
    np.testing.assert_array_equal(rollouts.held.sum(axis=1), round(HOLD * env.fps))
    assert not (rollouts.counted & rollouts.held).any()
    for counted, held, n in zip(rollouts.counted, rollouts.held, length, strict=True):
        assert counted[:n].all()
        assert held[n : n + 50].all()
    assert rollouts.object_pose.shape[1] == rollouts.reward.shape[1] == length.max() + 50


def test_nothing_ends_a_rollout_early(env, hands):
    """An action that throws the object away: it goes on to fall, and its last frames count."""

    def push(parameters, observation):
        return jnp.ones((observation.shape[0], 26))

    thrown = make_roll_out(env, push)(None)
    error = np.linalg.norm(thrown.object_pose[..., :3] - thrown.object_reference[..., :3], axis=-1)
    length = np.asarray(env.reference.length)
    for k, n in enumerate(length):
        assert error[k, n - 1] > env.task.termination_distance
        lost = np.argmax(error[k] > env.task.termination_distance)
        assert thrown.counted[k, lost:n].all()
        assert not np.array_equal(thrown.qpos[k, n - 2], thrown.qpos[k, 0])  # no restart


def test_it_starts_at_the_first_frame_and_steps_the_environment(env, rollouts):
    state = jax.vmap(env.start)(jnp.arange(2, dtype=jnp.int32), jnp.zeros(2, jnp.int32))
    np.testing.assert_array_equal(rollouts.qpos[:, 0], state.pipeline_state.physics.qpos)
    step = jax.jit(jax.vmap(env.step))
    for t in range(1, 4):
        state = step(state, jnp.zeros((2, 26)))
        np.testing.assert_allclose(rollouts.qpos[:, t], state.pipeline_state.physics.qpos, atol=1e-6)
        np.testing.assert_allclose(rollouts.reward[:, t], state.reward, atol=1e-5)


def test_joints_and_tips_are_where_mujoco_has_them(env, rollouts):
    """The recorded positions put back into MuJoCo: its bodies and tip sites, at frames before and after the grasp."""
    for k, t in ((0, 0), (1, 120), (0, 250)):
        data = mujoco.MjData(env.models[k])
        data.qpos = rollouts.qpos[k, t]
        mujoco.mj_forward(env.models[k], data)
        bodies = np.stack([data.body(name).xpos for name in LINKS])
        np.testing.assert_allclose(rollouts.joints[k, t], bodies, atol=1e-5)
        tips = [data.site(f"{finger}_tip").xpos for finger in FINGERS]
        np.testing.assert_allclose(rollouts.tips[k, t], tips, atol=1e-5)


def test_references_hold_their_last_frame(env, rollouts):
    for k, n in enumerate(np.asarray(env.reference.length)):
        pose = np.asarray(env.reference.object_pose)[k]
        np.testing.assert_array_equal(rollouts.object_reference[k, :n], pose[:n])
        for rows in (rollouts.object_reference, rollouts.joints_reference, rollouts.tips_reference):
            np.testing.assert_array_equal(rows[k, n:], np.broadcast_to(rows[k, n - 1], rows[k, n:].shape))
    # Where the twin follows, achieved and demonstrated joints are the same points of the hand.
    assert np.linalg.norm(rollouts.joints - rollouts.joints_reference, axis=-1)[:, :80].mean() < 0.003
