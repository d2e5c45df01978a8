import copy

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from envs.replay import assisted_replay
from envs.scene import NUM_WRIST, OBJECT
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.hand.joints import NUM_HINGES

NUM_TARGETS = NUM_WRIST + NUM_HINGES


def test_states_are_reproducible_and_do_not_touch_the_models(env):
    before = copy.deepcopy(env.models[0].body_mass)
    first, second = (assisted_replay(env.models, env.reference, env.task.substeps) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(env.models[0].body_mass, before)


def test_the_object_is_at_its_reference_and_moves_as_it_does(env):
    qpos, qvel, _ = assisted_replay(env.models, env.reference, env.task.substeps)
    pose = np.asarray(env.reference.object_pose, float)
    np.testing.assert_allclose(qpos[..., NUM_TARGETS:], pose, atol=1e-9)
    assert not qvel[:, 0].any()
    # Velocities belong to positions: half a frame forwards from one frame meets half a frame backwards from the next.
    linear, dt = qvel[:, 1:-1, NUM_TARGETS : NUM_TARGETS + 3], env.dt
    np.testing.assert_allclose(linear, (pose[:, 2:, :3] - pose[:, :-2, :3]) / (2 * dt), atol=1e-6)
    turned = Rotation.from_rotvec(qvel[0, 1:-1, NUM_TARGETS + 3 :] * 2 * dt)  # in the object's own frame
    before = Rotation.from_quat(pose[0, :-2, 3:], scalar_first=True)
    after = Rotation.from_quat(pose[0, 2:, 3:], scalar_first=True)
    assert ((before * turned).inv() * after).magnitude().max() < 1e-6


def test_the_hand_is_near_its_targets(env):
    qpos, _, controls = assisted_replay(env.models, env.reference, env.task.substeps)
    error = np.abs(qpos[..., :NUM_TARGETS] - np.asarray(env.reference.targets))
    assert error[..., :3].mean() < 0.001
    assert error[..., 3:].mean() < 0.05  # fingers press, and so stop short of what they are told
    low, high = env.models[0].actuator_ctrlrange.T
    assert (controls >= low).all()
    assert (controls <= high).all()


def test_most_mid_grasp_starts_hold_the_object_by_themselves(demonstrations, hands, lifted):
    """From the table's states, with a firm grip and no action at all, most objects are in place 0.2 s later."""
    env = TrackingEnv(demonstrations, hands, "native", Task(grip_force=8.0))
    demos = np.concatenate([np.full(len(f[:-15:5]), k) for k, f in enumerate(lifted)])
    frames = np.concatenate([f[:-15:5] for f in lifted])
    state = jax.vmap(env.start)(jnp.asarray(demos, jnp.int32), jnp.asarray(frames, jnp.int32))
    step = jax.jit(jax.vmap(env.step))
    for _ in range(10):
        state = step(state, jnp.zeros((len(demos), 26)))
    assert not np.asarray(state.metrics["unstable"]).any()
    assert (np.asarray(state.metrics["error/position"]) < 0.02).mean() > 0.7
    assert env.models[0].body(OBJECT).mass[0] < 0.5  # it is the real object that was held
