import copy
import dataclasses

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.rewards import RewardWeights
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS
from mjx_hand.pytree import replace


@pytest.fixture(scope="module")
def step(env):
    return jax.jit(env.step)


@pytest.fixture(scope="module")
def start(env):
    """A state in the middle of each demonstration, by demonstration and frame."""
    return jax.jit(env.start)


@pytest.fixture(scope="module")
def action():
    return jnp.asarray(np.random.default_rng(0).uniform(-1, 1, 26), jnp.float32)


def at(start, demonstration, frame):
    return start(jnp.asarray(demonstration, jnp.int32), jnp.asarray(frame, jnp.int32))


def test_the_reward_is_the_papers(env, start, step, action):
    """exp(-alpha_p |dp|) + exp(-alpha_r angle) - c |a|^2, by NumPy and SciPy from positions alone."""
    state = step(at(start, 1, 150), action)
    pose = np.asarray(state.pipeline_state.physics.qpos[26:], float)
    reference = np.asarray(env.reference.object_pose)[1, 151]
    distance = np.linalg.norm(pose[:3] - reference[:3])
    found, wanted = (Rotation.from_quat(p[3:], scalar_first=True) for p in (pose, reference))
    angle = (found * wanted.inv()).magnitude()
    expected = np.exp(-30 * distance) + np.exp(-2 * angle) - 0.002 * np.sum(np.asarray(action) ** 2)
    assert float(state.reward) == pytest.approx(expected, abs=1e-4)
    assert float(state.metrics["error/position"]) == pytest.approx(distance, abs=1e-6)
    assert float(state.metrics["error/rotation"]) == pytest.approx(angle, abs=1e-4)


def test_other_terms_count_by_their_weights(env, action):
    """Joints, finger tips and the commands' smoothness, by NumPy from the state and the engine's own tip sites."""
    weights = RewardWeights(position=0.0, rotation=2.0, action=0.0, joints=0.5, tips=0.25, action_rate=0.125)
    weighted = copy.copy(env)
    weighted.task = dataclasses.replace(env.task, rewards=weights)
    before = weighted.start(jnp.asarray(1, jnp.int32), jnp.asarray(150, jnp.int32))
    state = jax.jit(weighted.step)(before, action)
    physics, reference = state.pipeline_state.physics, env.reference
    off = np.asarray(physics.qpos[6:26]) - np.asarray(reference.targets)[1, 151, 6:]
    apart = np.asarray(physics.sensordata).reshape(5, 3) - np.asarray(reference.tips)[1, 151]
    rate = np.asarray(state.pipeline_state.residual) / np.array([0.02] * 3 + [0.2] * 3 + [0.7] * 20)
    expected = {
        "reward/position": 0.0,
        "reward/rotation": 2 * np.exp(-2 * float(state.metrics["error/rotation"])),
        "reward/action": 0.0,
        "reward/joints": 0.5 * np.exp(-5 * np.abs(off).mean()),
        "reward/tips": 0.25 * np.exp(-30 * np.linalg.norm(apart, axis=1).mean()),
        "reward/action_rate": -0.125 * np.sum(rate**2),
    }
    found = {name: float(value) for name, value in state.metrics.items() if name.startswith("reward/")}
    assert found == pytest.approx(expected, abs=1e-5)
    assert float(state.reward) == pytest.approx(sum(expected.values()), abs=1e-5)
    assert set(before.metrics) == set(state.metrics)
    assert np.abs(off).max() > 1e-3
    assert 1e-4 < np.linalg.norm(apart, axis=1).mean() < 0.05  # the demonstration's own tips, and not exactly


def test_the_reference_has_its_tips_where_the_engine_has_them(env):
    """A twin put into the demonstrated posture has its tip sites there."""
    for which, frame in ((0, 0), (1, 120)):
        data = mujoco.MjData(env.models[which])
        data.qpos[:26] = np.asarray(env.reference.targets)[which, frame]
        mujoco.mj_forward(env.models[which], data)
        tips = np.asarray(env.reference.tips)[which, frame]
        np.testing.assert_allclose([data.site(f"{finger}_tip").xpos for finger in FINGERS], tips, atol=1e-5)


def test_the_residual_is_filtered_and_scaled_and_commanded(env, start, step, action):
    scale = np.array([0.02] * 3 + [0.2] * 3 + [0.7] * 20)
    state, residual = at(start, 0, 100), np.zeros(26)
    for k in range(3):
        before = state
        state = step(state, action)
        residual = 0.9 * residual + 0.1 * scale * np.asarray(action)
        np.testing.assert_allclose(state.pipeline_state.residual, residual, atol=1e-7)
        low, high = env.models[0].actuator_ctrlrange.T
        target = np.clip(np.asarray(env.reference.controls)[0, 101 + k] + residual, low, high)
        wanted = env.engine.step(before.pipeline_state.physics, jnp.asarray(target, jnp.float32))
        np.testing.assert_allclose(state.pipeline_state.physics.qpos, wanted.qpos, atol=1e-5)


def test_actions_beyond_one_count_as_one(start, step):
    big, one = (step(at(start, 0, 100), jnp.full(26, size)) for size in (7.0, 1.0))
    np.testing.assert_array_equal(big.pipeline_state.residual, one.pipeline_state.residual)
    assert big.reward == one.reward


def test_the_end_truncates_and_holds_the_last_frame(env, start, step):
    length = int(env.reference.length[0])
    state = at(start, 0, length - 3)
    done, truncated, frames = [], [], []
    for _ in range(4):
        state = step(state, jnp.zeros(26))
        done.append(float(state.done))
        truncated.append(float(state.info["truncation"]))
        frames.append(int(state.pipeline_state.frame))
    lost = float(state.metrics["error/position"]) > env.task.termination_distance
    assert frames == [length - 2, length - 1, length - 1, length - 1]
    assert done == [0, 1, 1, 1]
    assert not lost
    assert truncated == [0, 1, 1, 1]


def test_losing_the_object_ends_a_rollout_and_is_no_truncation(env, start, step):
    """The state of a demonstration's middle, told that it is at its start: the object is far away."""
    state = at(start, 0, 0)
    pose = np.asarray(env.reference.object_pose)[0, : int(env.reference.length[0])]
    farthest = int(np.linalg.norm(pose[:, :3] - pose[0, :3], axis=1).argmax())
    away = at(start, 0, farthest).pipeline_state.physics
    twin = replace(state.pipeline_state, physics=away)
    state = step(state.replace(pipeline_state=twin), jnp.zeros(26))
    assert float(state.metrics["error/position"]) > env.task.termination_distance
    assert (float(state.done), float(state.info["truncation"])) == (1, 0)


def test_a_diverged_world_is_done(env, start, step):
    twin = at(start, 0, 100).pipeline_state
    state = step(at(start, 0, 100).replace(pipeline_state=replace(twin, residual=jnp.full(26, jnp.nan))), jnp.zeros(26))
    assert float(state.metrics["unstable"]) == 1
    assert (float(state.done), float(state.info["truncation"])) == (1, 0)


def test_observations_are_finite_and_bounded_everywhere(env, start):
    demos, frames = np.divmod(np.arange(2 * 200), 200)
    state = jax.jit(jax.vmap(env.start))(jnp.asarray(demos, jnp.int32), jnp.asarray(frames, jnp.int32))
    seen = np.asarray(state.obs)
    assert seen.shape == (400, env.observation_size)
    assert np.isfinite(seen).all()
    assert np.abs(seen).max() <= 5
    assert (seen.std(axis=0) > 1e-4).mean() > 0.75  # all but residuals, which begin at none, and fingers that idle
    assert (np.abs(seen) >= 5).mean() < 0.02  # and are not cut off


def test_the_observation_tells_the_objects_error(env, start):
    """Move the object 1 cm up in the world: exactly the features about the object change, those of the hand do not."""
    twin = at(start, 0, 150).pipeline_state
    moved = replace(twin, physics=replace(twin.physics, qpos=twin.physics.qpos.at[28].add(0.01)))
    change = np.asarray(env._observe(moved) - env._observe(twin))
    own = slice(0, 26 + 26 + 26 + 20)
    np.testing.assert_array_equal(change[own], 0)
    error = change[98:101]  # in the wrist's base frame, 30 per metre
    assert np.linalg.norm(error) == pytest.approx(0.3, abs=1e-4)
    np.testing.assert_allclose(np.asarray(env.reference.base)[0] @ error, [0, 0, 0.3], atol=1e-4)


def test_a_reset_only_looks_up(env):
    """No physics in it: what it compiles to has no call of the engine."""
    text = jax.jit(env.reset).lower(jax.random.key(0)).as_text()
    assert "callback" not in text
    state = jax.jit(env.reset)(jax.random.key(0))
    twin = state.pipeline_state
    table = jax.tree.map(lambda leaf: leaf[twin.demonstration, twin.frame], env.tables.starts)
    jax.tree.map(np.testing.assert_array_equal, twin.physics, table)


def test_resets_follow_the_share_of_mid_starts(env):
    states = jax.jit(jax.vmap(env.reset))(jax.random.split(jax.random.key(1), 2000))
    frame, which = np.asarray(states.pipeline_state.frame), np.asarray(states.pipeline_state.demonstration)
    assert (frame > 0).mean() == pytest.approx(0.7, abs=0.05)
    assert which.mean() == pytest.approx(0.5, abs=0.05)
    length = np.asarray(env.reference.length)[which]
    assert (frame < length - 10).all()
    assert (frame > length / 2).any()


def test_a_demonstration_at_another_rate_is_refused(demonstrations, hands):
    slow = [replace(d, motion=replace(d.motion, fps=30.0)) for d in demonstrations]
    with pytest.raises(InputError, match=r"30 frames/s do not fit control steps of 20 ms; resample .* 50"):
        TrackingEnv(slow, hands, "native", Task(grip_force=0.0))
