"""An environment with disturbances: nothing at zero, and each of them by a law that knows nothing of it."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brax.envs.base import State
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from envs.disturbances import Episode, Randomize, draw_episode, episode_tables
from envs.disturbances.episode import delayed, pushing, seen_pose
from envs.evaluation.roll_out import make_roll_out, zero_residual
from envs.scene import OBJECT
from envs.tracking import TrackingEnv
from envs.twin import twin_of
from mjx_hand.errors import InputError


@pytest.fixture(scope="module")
def made(demonstrations, hands):
    known: dict[Randomize, TrackingEnv] = {}

    def make(randomize: Randomize) -> TrackingEnv:
        if randomize not in known:
            known[randomize] = TrackingEnv(demonstrations, hands, "native", randomize=randomize)
        return known[randomize]

    return make


def episode_of(state: State) -> Episode:
    episode = twin_of(state).episode
    assert episode is not None
    return episode


def starts(env: TrackingEnv, count: int) -> State:
    return jax.jit(jax.vmap(env.reset))(jax.random.split(jax.random.key(5), count))


def test_where_nothing_is_disturbed_nothing_changes(env, made):
    usual, same = make_roll_out(env, zero_residual), make_roll_out(made(Randomize.only()), zero_residual)
    assert_array_equal(same(None).qpos, usual(None).qpos)


def test_another_rows_tables_make_the_same_compiled_rollout_another(made):
    roll_out = make_roll_out(made(Randomize.only()), zero_residual)
    moved = roll_out(None, made(Randomize.only(move=(0.02, 0.02))).tables)
    off = moved.object_pose[:, 0, :2] - moved.object_reference[:, 0, :2]
    assert_allclose(np.linalg.norm(off, axis=-1), 0.02, atol=1e-5)
    assert_array_equal(moved.object_reference, roll_out(None).object_reference)


def test_objects_elsewhere_start_at_frame_0_and_others_anywhere(made):
    env = made(Randomize(share=1.0, variants=4))
    state = starts(env, 400)
    twin = twin_of(state)
    elsewhere = np.array([v.is_elsewhere for own in env.variations for v in own])[np.asarray(twin.physics.variant)]
    assert 0.4 < elsewhere.mean() < 0.6
    frame = np.asarray(twin.frame)
    assert (frame[elsewhere] == 0).all()
    assert (frame[~elsewhere] > 0).mean() > 0.5
    assert_array_equal(np.asarray(twin.physics.variant) // 4, np.asarray(twin.demonstration))
    assert set(np.asarray(episode_of(state).delay).tolist()) == {0, 1, 2}
    pushed = np.linalg.norm(episode_of(state).push, axis=-1)
    assert 0.35 < (pushed > 0).mean() < 0.65
    assert 10 < pushed.max() <= 12
    assert len(np.unique(np.asarray(episode_of(state).seen_offset), axis=0)) == 400


def test_late_targets_arrive_in_order(made):
    env = made(Randomize.only(delay=(2, 2)))
    held = jnp.full(26, 7.0)
    tables = env.tables.disturbances
    assert tables is not None
    episode = draw_episode(tables.episode, jnp.asarray(0), held, jax.random.key(1))
    arrived = []
    for sent in range(5):
        episode, targets = delayed(episode, jnp.full(26, float(sent)))
        arrived.append(float(targets[3]))
    assert arrived == [7.0, 7.0, 0.0, 1.0, 2.0]


def test_a_push_lasts_as_long_as_it_should_while_the_object_is_held(made):
    env = made(Randomize.only(push=(10.0, 10.0)))
    state, reference = starts(env, 200), env.reference
    tables, twin = env.tables.disturbances, twin_of(state)
    assert tables is not None
    frames = jnp.arange(env.num_frames)
    force = np.asarray(jax.vmap(lambda e: jax.vmap(lambda f: pushing(e, tables.episode, f))(frames))(twin.episode))
    size = np.linalg.norm(force[..., :3], axis=-1)
    assert_allclose(size[size > 0], 10.0, rtol=1e-5)
    assert_array_equal((size > 0).sum(axis=1), round(0.2 * env.fps))
    assert_array_equal(force[..., 2:], 0)
    pose = np.asarray(reference.object_pose)[np.asarray(twin.demonstration)]
    away = np.linalg.norm(pose[..., :3] - pose[:, :1, :3], axis=-1)
    assert away[size > 0].min() > 0.01
    length = np.asarray(reference.length)[np.asarray(twin.demonstration)]
    assert not size[np.arange(200), length - 1].any(), "the last frame, which evaluations hold on"


def test_a_push_moves_a_free_object_as_newton_says(made):
    env = made(Randomize.only(push=(10.0, 10.0)))
    state = jax.jit(env.start)(0, 0)
    twin = twin_of(state)
    pose = np.array(twin.physics.qpos)
    pose[26 + 2] += 0.5  # in the air, with nothing near
    physics = env.engine.reset(twin.physics.variant, jnp.asarray(pose), jnp.zeros(32), jnp.zeros(32))
    episode = dataclasses.replace(episode_of(state), push=jnp.array([6.0, -8.0, 0.0]), push_start=jnp.asarray(0))
    twin = dataclasses.replace(twin, physics=physics, episode=episode)
    after = twin_of(jax.jit(env.step)(state.replace(pipeline_state=twin), jnp.zeros(26)))
    mass = float(env.engine.models[0].body(OBJECT).mass[0])
    wanted = env.dt * np.array([6.0 / mass, -8.0 / mass, -9.81])
    assert_allclose(after.physics.qvel[26:29], wanted, rtol=1e-4)


def test_the_pose_is_seen_off_by_what_is_asked_and_is_not_changed(env, made):
    seen = made(Randomize.only(seen_move=(0.01, 0.01), seen_turn_deg=(5.0, 5.0)))
    usual, other = (jax.jit(e.start)(0, 0) for e in (env, seen))
    assert_array_equal(twin_of(usual).physics.qpos, twin_of(other).physics.qpos)
    tables = seen.tables.disturbances
    assert tables is not None
    pose = twin_of(other).physics.qpos[26:]
    found = np.asarray(seen_pose(episode_of(other), tables.episode, jnp.asarray(3), pose))
    assert np.linalg.norm(found[:3] - pose[:3]) == pytest.approx(0.01, rel=1e-4)
    before, after = (Rotation.from_quat(np.asarray(q), scalar_first=True) for q in (pose[3:], found[3:]))
    assert np.rad2deg((after * before.inv()).magnitude()) == pytest.approx(5.0, rel=1e-3)
    assert not np.allclose(usual.obs, other.obs, atol=1e-2)


def test_noise_is_as_wide_as_asked_and_new_in_every_step(made):
    env = made(Randomize.only(seen_noise=0.002, seen_noise_deg=1.0))
    tables = env.tables.disturbances
    assert tables is not None
    episode, pose = episode_of(jax.jit(env.start)(0, 0)), jnp.array([0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0])
    seen = np.asarray(jax.vmap(lambda f: seen_pose(episode, tables.episode, f, pose))(jnp.arange(3000)))
    assert seen[:, :3].std(axis=0) == pytest.approx([0.002] * 3, rel=0.06)
    assert np.rad2deg(2 * seen[:, 4:]).std(axis=0) == pytest.approx([1.0] * 3, rel=0.06)
    assert_allclose(seen[:, :3].mean(axis=0), pose[:3], atol=2e-4)


def test_ranges_shrink_towards_what_is_neutral():
    half = Randomize(share=0.5).scaled()
    assert half.move == (0.0, 0.02)
    assert half.mass == pytest.approx((0.85, 1.5))
    assert half.delay == (0, 1)
    off = dataclasses.replace(Randomize(share=0.0).scaled(), variants=1, moved_share=1.0, push_prob=1.0)
    assert off == Randomize.only()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"mass": (2.0, 1.0)}, r"randomize.mass is \[2.0, 1.0\]; give the least and the greatest value"),
        ({"mass": (0.0, 1.0)}, r"within \[0.1,10\]"),
        ({"move": (0.0, 1.0)}, r"within \[0,0.2\]"),
        ({"move": (float("nan"), 0.1)}, "randomize.move"),
        ({"delay": (0, 9)}, r"within \[0,5\]"),
        ({"share": 1.5}, "randomize.share is 1.5"),
        ({"variants": 0}, "at least 1 scene"),
        ({"push_prob": 2.0}, "must lie between 0 and 1"),
        ({"seen_noise": -1.0}, "must not be negative"),
    ],
)
def test_ranges_that_cannot_be_are_refused(given, said):
    with pytest.raises(InputError, match=said):
        Randomize(**given)


def test_a_demonstration_that_is_never_held_is_never_pushed(env):
    frames = env.num_frames
    still = [np.repeat(d.object_pose[:1], d.num_frames, axis=0) for d in env.demonstrations]
    tables = episode_tables(Randomize.only(push=(5.0, 5.0)), still, env.fps)
    for key in jax.random.split(jax.random.key(0), 5):
        episode = draw_episode(tables, jnp.asarray(0), jnp.zeros(26), key)
        assert not np.any(jax.vmap(lambda f, e=episode: pushing(e, tables, f))(jnp.arange(frames)))
