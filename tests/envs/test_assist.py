"""The virtual object controller, and what the learner tells environments about its progress."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.parallel import ParallelEnv
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.pytree import replace

STIFFNESS = 100.0


@pytest.fixture(scope="module")
def assisted(demonstrations, hands) -> TrackingEnv:
    return TrackingEnv(demonstrations, hands, "native", Task(assist=STIFFNESS, assist_until=1.0))


@pytest.fixture(scope="module")
def step(assisted):
    return jax.jit(assisted.step)


def displaced(env, demonstration, turn, move):
    """The object alone in the air, at rest, off its first pose; the demonstration stands still there at first."""
    state = env.start(jnp.asarray(demonstration, jnp.int32), jnp.asarray(0, jnp.int32))
    qpos = np.array(state.pipeline_state.physics.qpos)
    qpos[:3] += 1.0  # the hand is elsewhere
    pose = np.array(env.reference.object_pose)[demonstration, 0]
    pose[2] += 0.5
    poses = jnp.broadcast_to(jnp.asarray(pose, jnp.float32), env.reference.object_pose.shape)
    qpos[26:29] = pose[:3] + move
    turned = Rotation.from_rotvec(turn) * Rotation.from_quat(pose[3:], scalar_first=True)
    qpos[29:] = turned.as_quat(scalar_first=True)
    physics = env.engine.reset(
        jnp.asarray(demonstration, jnp.int32), jnp.asarray(qpos, jnp.float32), jnp.zeros(32), jnp.zeros(32)
    )
    return state.replace(pipeline_state=replace(state.pipeline_state, physics=physics)), poses, turned


@pytest.mark.parametrize("progress", [0.0, 0.5, 1.0])
def test_it_pulls_and_turns_the_object_to_its_reference(assisted, progress):
    """From rest, and held for one control step: speed = stiffness x error x time, whatever the mass; and gravity."""
    move, turn = np.array([0.01, -0.02, 0.03]), np.array([0.1, 0.2, -0.1])
    for demonstration in range(2):
        state, poses, turned = displaced(assisted, demonstration, turn, move)
        moved = replace(assisted.tables, reference=replace(assisted.reference, object_pose=poses))
        state = state.replace(info={**state.info, "progress": jnp.asarray(progress)})
        speed = np.asarray(assisted.with_tables(moved).step(state, jnp.zeros(26)).pipeline_state.physics.qvel[26:])
        pull = STIFFNESS * (1 - progress) * assisted.dt
        np.testing.assert_allclose(speed[:3], [*(-pull * move[:2]), -pull * move[2] - 9.81 * assisted.dt], atol=2e-4)
        np.testing.assert_allclose(speed[3:], turned.inv().apply(-pull * turn), atol=2e-3)


def test_a_finished_training_helps_nobody(assisted, env, step):
    """Without progress from a learner, steps are those of an environment without motors, bit for bit."""
    plain, action = jax.jit(env.step), jnp.asarray(np.random.default_rng(1).uniform(-1, 1, 26), jnp.float32)
    at = jnp.asarray(1, jnp.int32), jnp.asarray(120, jnp.int32)
    one, other = assisted.start(*at), env.start(*at)
    for _ in range(5):
        one, other = step(one, action), plain(other, action)
    np.testing.assert_array_equal(one.pipeline_state.physics.qpos, other.pipeline_state.physics.qpos)


def test_it_lifts_an_object_that_the_hand_leaves_behind(demonstrations, hands, step, assisted):
    """At the beginning of a training the object follows its reference without a grip, at its end it does not."""
    last = int(assisted.reference.length[0]) - 2

    def highest(progress):
        state = assisted.start(jnp.asarray(0, jnp.int32), jnp.asarray(0, jnp.int32))
        state = state.replace(info={**state.info, "progress": jnp.asarray(progress)})
        errors = []
        for _ in range(last):
            state = step(state, jnp.zeros(26).at[6:].set(-0.5))  # fingers wide open
            errors.append(float(state.metrics["error/position"]))
        return max(errors)

    assert highest(1.0) > 0.09
    assert highest(0.0) < 0.7 * highest(1.0)


def test_progress_reaches_every_world_and_survives_restarts(env):
    parallel = ParallelEnv(env)
    state = jax.jit(parallel.reset)(jax.random.split(jax.random.key(0), 4))
    state = state.replace(info={**state.info, "progress": jnp.full(4, 0.25)})
    far = replace(state.pipeline_state, frame=env.reference.length[state.pipeline_state.demonstration] - 2)
    after = jax.jit(parallel.step)(state.replace(pipeline_state=far), jnp.zeros((4, 26)))
    assert (np.asarray(after.done) == 1).all()
    np.testing.assert_array_equal(after.info["progress"], 0.25)


def test_termination_tightens(env):
    """An error of 5 cm ends an episode late in the training, not early."""
    tight = dataclasses.replace(env.task, termination_distance=0.08, termination_distance_last=0.04)
    at = jnp.asarray(0, jnp.int32), jnp.asarray(0, jnp.int32)
    state = env.start(*at)
    pose = env.reference.object_pose.at[..., 0].add(0.05)
    done = []
    for progress in (0.0, 1.0):
        moved = env.with_tables(replace(env.tables, reference=replace(env.reference, object_pose=pose)))
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(moved, "task", tight)
            info = {**state.info, "progress": jnp.asarray(progress)}
            done.append(float(moved.step(state.replace(info=info), jnp.zeros(26)).done))
    assert done == [0, 1]
