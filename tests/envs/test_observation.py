"""The observation against its formula, written out once more from the state by NumPy and SciPy."""

import dataclasses

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.observation import observe, observed_features
from envs.task import Task
from mjx_hand.player.features import CONTACT_FORCES, offsets_and_scales
from mjx_hand.player.observed_state import TARGETS

TARGET_SCALE = np.concatenate([np.full(3, 50.0), np.full(23, 5.0)])
SPEED_SCALE = np.concatenate([np.full(3, 5.0), np.full(3, 0.5), np.full(20, 0.2)])


def rotation(quaternion) -> Rotation:
    return Rotation.from_quat(np.asarray(quaternion, float), scalar_first=True)


def expected(env, demonstration: int, frame: int, twin) -> np.ndarray:
    reference, task = env.reference, env.task
    qpos, qvel = np.asarray(twin.physics.qpos, float), np.asarray(twin.physics.qvel, float)
    data = mujoco.MjData(env.models[demonstration])
    data.qpos[:] = qpos
    mujoco.mj_kinematics(env.models[demonstration], data)
    base, length = np.asarray(reference.base[demonstration], float), int(reference.length[demonstration])
    targets, poses = (np.asarray(a[demonstration], float) for a in (reference.targets, reference.object_pose))
    later = np.minimum(frame + np.array(task.lookahead), length - 1)
    tips = np.array([data.site(f"{f}_tip").xpos for f in ("index", "middle", "pinky", "ring", "thumb")])
    wrist, thing = data.body("wrist"), rotation(qpos[29:])
    residual_scale = np.array([task.residual_scale_wrist_position] * 3 + [task.residual_scale_wrist_rotation] * 3)
    residual_scale = np.concatenate([residual_scale, np.full(20, task.residual_scale_fingers)])
    features = [
        (qpos[:26] - targets[frame]) * TARGET_SCALE,
        qvel[:26] * SPEED_SCALE,
        np.asarray(twin.residual, float) / residual_scale,
        np.asarray(reference.grip, float)[demonstration, frame, 6:] * 5,
        base.T @ (qpos[26:29] - poses[frame, :3]) * 30,
        (rotation(poses[frame, 3:]).inv() * thing).as_rotvec() * 3,
        base.T @ qvel[26:29] * 3,
        qvel[29:] * 0.2,
        (wrist.xmat.reshape(3, 3).T @ (qpos[26:29] - wrist.xpos) - [-0.1, -0.05, 0.03]) * 10,
        thing.inv().apply(tips - qpos[26:29]) * 30,
        (targets[later] - targets[frame]) * TARGET_SCALE,
        (poses[later, :3] - poses[frame, :3]) @ base * 30,
        [2 * frame / length - 1, (qpos[28] - poses[0, 2]) * 10],
        np.asarray(reference.features[demonstration], float)[:3] * 30,
        np.asarray(reference.features[demonstration], float)[5:],  # mass and friction, between them, are not seen
    ]
    return np.clip(np.concatenate([np.ravel(f) for f in features]), -5, 5)


@pytest.fixture(scope="module")
def step(env):
    return jax.jit(env.step)


@pytest.mark.parametrize(("demonstration", "frame"), [(0, 0), (1, 150), (1, 10**6)])
def test_the_observation_is_its_formula(env, step, demonstration, frame):
    last = int(env.reference.length[demonstration]) - 1
    start = jax.jit(env.start)(jnp.asarray(demonstration, jnp.int32), jnp.asarray(min(frame, last), jnp.int32))
    action = jnp.asarray(np.random.default_rng(0).uniform(-1, 1, 26), jnp.float32)
    for state in (start, step(start, action)):
        twin = state.pipeline_state
        wanted = expected(env, demonstration, int(twin.frame), twin)
        np.testing.assert_allclose(state.obs, wanted, atol=1e-4)
    assert np.abs(np.asarray(state.pipeline_state.residual)).max() > 0


def test_a_policy_may_feel_what_each_link_presses(env, step):
    start = jax.jit(env.start)(jnp.asarray(0, jnp.int32), jnp.asarray(150, jnp.int32))
    state = step(start, jnp.zeros(26))
    twin = state.pipeline_state
    forces = np.asarray(twin.physics.contact)[:, :3]
    assert np.linalg.norm(forces, axis=-1).sum() > 1.0
    task = dataclasses.replace(env.task, observe_forces=True)
    told = env.reference, task, env.body, twin.demonstration, twin.frame, twin.physics, twin.residual
    felt = np.asarray(observe(*told))
    rows = [[feature.name] * feature.size for feature in observed_features(task, env.body.names)]
    names = np.concatenate(rows)
    np.testing.assert_allclose(felt[names != CONTACT_FORCES], state.obs, atol=1e-6)
    data = mujoco.MjData(env.models[0])
    data.qpos[:] = twin.physics.qpos
    mujoco.mj_kinematics(env.models[0], data)
    wanted = np.clip(0.1 * forces @ data.body("wrist").xmat.reshape(3, 3), -5, 5)
    np.testing.assert_allclose(felt[names == CONTACT_FORCES], wanted.ravel(), atol=1e-4)


def test_the_table_names_every_number_once():
    task = Task(lookahead=(2, 7), residual_scale_fingers=0.5)
    table = observed_features(task)
    assert len({feature.name for feature in table}) == len(table)
    assert len(TARGETS) == 26
    offset, scale = offsets_and_scales(table)
    assert len(offset) == len(scale) == sum(len(feature.elements) for feature in table) == 225 - 29
    names = [f"{feature.name}:{element}" for feature in table for element in feature.elements]
    assert scale[names.index("residual.hinges:index_mcp_flexion")] == 2
    assert {feature.unit for feature in table if feature.name.startswith("ahead_7")} == {"m", "rad"}
    assert dataclasses.replace(table[0], elements=("a",)).size == 1
