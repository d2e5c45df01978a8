"""A teleoperated hand: what it is commanded, what its policy sees, and where its episodes start."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.commands import EXPERT, next_command
from envs.demonstrations.streamed_hand import streamed_demonstration
from envs.evaluation.constant_press import constant_press
from envs.observation import observed_features
from envs.reference import demonstrated_targets
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from train.experiment.setup import without_grip
from train.settings.config import compose

TASK = Task(live=True, contacts="object", observe_forces=True)


@pytest.fixture(scope="module")
def live(demonstrations, hands):
    streamed = [streamed_demonstration(d, seed) for seed, d in enumerate(demonstrations)]
    return TrackingEnv(streamed, hands, "native", TASK)


def test_the_tracked_hand_is_what_is_commanded(live, demonstrations):
    tracked = np.asarray(live.demonstrations[0].tracked)
    told = np.asarray(live.reference.controls[0, : len(tracked)])
    np.testing.assert_allclose(told[:, 6:], tracked[:, 7:], atol=1e-6)
    clean = demonstrated_targets(live.demonstrations[0])
    assert 1e-4 < np.abs(told[:, :3] - clean[:, :3]).mean() < 5e-3


def test_what_it_lacks_is_the_press_of_a_hand_that_is_not_led(live, hands):
    """Tracked hand and what it lacks together are the controls of the same demonstration, replayed as it is."""
    task = dataclasses.replace(TASK, live=False)
    plain = TrackingEnv(live.demonstrations, hands, "native", task).reference
    together = np.asarray(live.reference.controls + live.reference.lacking)
    np.testing.assert_allclose(together[..., 6:], np.asarray(plain.controls)[..., 6:], atol=1e-5)
    assert not np.any(np.asarray(live.reference.lacking)[..., :6])
    assert plain.lacking is None


def test_without_grip_and_pressed_it_is_the_tracked_hand_that_is_commanded(live):
    """The baselines of an evaluation: nothing is taken off a hand whose controls have no grip."""
    np.testing.assert_array_equal(without_grip(live).reference.controls, live.reference.controls)
    press = constant_press(live)
    nothing = press.tables(dict.fromkeys(press.full, 0.0)).reference
    np.testing.assert_allclose(nothing.controls - nothing.grip, live.reference.controls, atol=1e-6)
    demonstrated = demonstrated_targets(live.demonstrations[0])
    np.testing.assert_allclose(live.reference.targets[0, : len(demonstrated)], demonstrated, atol=1e-5)


def test_the_policy_sees_nothing_of_what_is_to_come(live):
    start = jax.jit(live.start)(jnp.asarray(0), jnp.asarray(120))
    reference = live.reference
    later = jnp.arange(live.num_frames) > 120
    other = dataclasses.replace(
        reference,
        targets=reference.targets + 0.3 * later[None, :, None],
        controls=reference.controls + 0.3 * later[None, :, None],
        object_pose=reference.object_pose + 0.1,
        length=reference.length + 7,
    )
    changed = live.with_tables(dataclasses.replace(live.tables, reference=other))
    seen = jax.jit(changed._observe)(start.pipeline_state)
    np.testing.assert_allclose(seen, start.obs, atol=1e-6)
    framed = {f.name for f in observed_features(TASK) if f.frame in ("base", "demonstrated object")}
    assert framed == {"residual.wrist_position"}  # which is nothing: the wrist is the person's


def test_it_sees_the_same_wherever_the_hand_is_and_faces(live):
    """Hand and object, moved and turned together about the vertical, look the same from the hand."""
    twin = jax.jit(live.start)(jnp.asarray(0), jnp.asarray(120)).pipeline_state
    c, s = np.cos(0.7), np.sin(0.7)
    about = jnp.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    shift = jnp.array([0.3, -0.2, 0.1])
    base, n = live.reference.base, live.body.num_coordinates
    qpos, qvel = twin.physics.qpos, twin.physics.qvel
    w, x, y, z = qpos[n + 3 :]
    a, d = np.cos(0.35), np.sin(0.35)
    turned = jnp.array([a * w - d * z, a * x - d * y, a * y + d * x, a * z + d * w])
    slides = qpos[:3] + base[0].T @ about.T @ shift
    moved = dataclasses.replace(
        twin,
        physics=dataclasses.replace(
            twin.physics,
            qpos=jnp.concatenate([slides, qpos[3:n], about @ qpos[n : n + 3] + shift, turned]),
            qvel=jnp.concatenate([qvel[:n], about @ qvel[n : n + 3], qvel[n + 3 :]]),
            sensordata=(twin.physics.sensordata.reshape(-1, 3) @ about.T + shift).ravel(),
            contact=twin.physics.contact.at[:, :3].set(twin.physics.contact[:, :3] @ about.T),
        ),
    )
    there = live.with_tables(
        dataclasses.replace(live.tables, reference=dataclasses.replace(live.reference, base=about @ base))
    )
    np.testing.assert_allclose(there._observe(moved), live._observe(twin), atol=2e-3)


def test_the_wrist_is_the_persons(live):
    state = jax.jit(live.start)(jnp.asarray(0), jnp.asarray(0))
    frame, residual, targets, _ = live.command(state.pipeline_state, jnp.ones(26))
    assert not np.any(np.asarray(residual[:6]))
    np.testing.assert_array_equal(targets[:6], live.reference.controls[0, frame, :6])
    np.testing.assert_allclose(targets[6:] - residual[6:], live.reference.controls[0, frame, 6:], atol=1e-6)
    assert np.all(np.asarray(residual[6:]) > 0)
    stepped = jax.jit(live.step)(state, jnp.ones(26))
    assert np.isfinite(np.asarray(stepped.obs)).all()
    assert np.isfinite(float(stepped.reward))


def test_an_episode_that_starts_in_the_middle_starts_pressing(live):
    start = jax.jit(live.start)
    assert not np.any(np.asarray(start(jnp.asarray(0), jnp.asarray(0)).pipeline_state.residual))
    middle = np.asarray(start(jnp.asarray(0), jnp.asarray(200)).pipeline_state.residual)
    lacking = np.asarray(live.reference.lacking[0, 200])
    np.testing.assert_allclose(middle[6:], np.clip(lacking[6:], -0.7, 0.7), atol=1e-6)
    assert np.abs(middle[6:]).max() > 0.05


def test_the_experts_action_is_the_residual_that_makes_up_for_what_is_lacking(live):
    state = jax.jit(live.start)(jnp.asarray(0), jnp.asarray(200))
    stepped = jax.jit(live.step)(state, jnp.zeros(26))
    wanted = np.asarray(live.reference.controls + live.reference.lacking)[0, 201]
    lacking = np.clip(wanted - np.asarray(stepped.pipeline_state.commanded), -0.7, 0.7)
    assert np.abs(lacking).max() > 0.05
    np.testing.assert_allclose(np.asarray(stepped.info[EXPERT])[6:] * 0.7, lacking[6:], atol=1e-6)


def test_a_hand_that_holds_is_steadied_and_a_free_one_is_followed(live):
    start = jax.jit(live.start)(jnp.asarray(0), jnp.asarray(200)).pipeline_state
    tracked = np.asarray(live.reference.controls[0, 200:202])
    gone = dataclasses.replace(start.physics, contact=jnp.zeros_like(start.physics.contact))
    free = np.asarray(next_command(live.reference, dataclasses.replace(start, physics=gone), jnp.asarray(201), 0.02))
    np.testing.assert_allclose(free, tracked[1], atol=1e-6)
    thumb = start.physics.contact.at[13:, 0].set(1.0).at[1, 0].set(1.0)
    holding = dataclasses.replace(start, physics=dataclasses.replace(start.physics, contact=thumb))
    held = np.asarray(next_command(live.reference, holding, jnp.asarray(201), 0.02))
    np.testing.assert_allclose(held[6:], tracked[0, 6:] + 0.02 / 0.8 * (tracked[1, 6:] - tracked[0, 6:]), atol=1e-6)
    np.testing.assert_allclose(held[:6], tracked[1, :6], atol=1e-6)


def test_the_experts_action_kept_up_leads_to_the_press(live):
    """An expert that acts again and again ends at what is lacking, within what residuals may be."""
    state = jax.jit(live.start)(jnp.asarray(0), jnp.asarray(0))
    step = jax.jit(live.step)
    for _ in range(200):
        state = step(state, state.info[EXPERT])
    twin = state.pipeline_state
    frame = int(twin.frame)
    wanted = np.asarray(live.reference.controls + live.reference.lacking)[0, frame] - np.asarray(twin.commanded)
    off = np.abs(np.asarray(twin.residual) - np.clip(wanted, -0.7, 0.7))[6:]
    assert off.mean() < 0.1 < np.abs(wanted[6:]).max()


def test_a_robots_hand_is_not_teleoperated_yet():
    with pytest.raises(InputError, match="person's hand alone"):
        compose(["config=live", "hand=allegro"])
    with pytest.raises(InputError, match=r"data\.streamed=true"):
        compose(["config=pinch", "task.live=true"])
    with pytest.raises(InputError, match=r"ppo\.imitation is 1"):
        compose(["config=pinch", "ppo.imitation=1"])


def test_a_hand_that_no_tracker_saw_is_refused(demonstrations, hands):
    with pytest.raises(InputError, match=r"data\.streamed=true"):
        TrackingEnv(demonstrations, hands, "native", TASK)
