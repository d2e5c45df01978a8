import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.parallel import ParallelEnv

WORLDS = 16


@pytest.fixture(scope="module")
def parallel(env):
    return ParallelEnv(env)


@pytest.fixture(scope="module")
def rollout(env, parallel):
    """States of 300 steps with no action: every world is restarted at least once."""
    keys = jax.random.split(jax.random.key(0), WORLDS)

    @jax.jit
    def run(keys):
        def step(state, _):
            state = parallel.step(state, jnp.zeros((WORLDS, 26)))
            return state, state

        first = parallel.reset(keys)
        return first, jax.lax.scan(step, first, length=300)[1]

    return run(keys)


def test_what_brax_reads_is_there(parallel, rollout):
    first, later = rollout
    assert parallel.observation_size == first.obs.shape[-1]
    assert parallel.action_size == 26
    for state in (first, later):
        assert {"truncation", "episode_done", "episode_metrics"} <= set(state.info)
        assert set(state.info["episode_metrics"]) == {"sum_reward", "length", *state.metrics}
    assert jax.tree.structure(first) == jax.tree.structure(later)


def test_a_world_that_ends_starts_anew_somewhere_else(env, rollout):
    first, later = rollout
    done, frame = np.asarray(later.done), np.asarray(later.pipeline_state.frame)
    demonstration = np.asarray(later.pipeline_state.demonstration)
    assert (done.sum(axis=0) >= 1).all()
    before = np.concatenate([np.asarray(first.pipeline_state.frame)[None], frame[:-1]])
    np.testing.assert_array_equal(frame[done == 0], before[done == 0] + 1)
    starts = {(int(d), int(f)) for d, f in zip(demonstration[done == 1], frame[done == 1], strict=True)}
    assert len(starts) > done.sum() / 4  # draws, not one kept start
    assert {d for d, _ in starts} == {0, 1}
    # A fresh world has its table's physics and no residual; the observation is the fresh state's.
    step, world = np.argwhere(done == 1)[0]
    twin = jax.tree.map(lambda leaf: leaf[step, world], later.pipeline_state)
    fresh = env.start(twin.demonstration, twin.frame)
    np.testing.assert_array_equal(twin.physics.qpos, fresh.pipeline_state.physics.qpos)
    np.testing.assert_array_equal(twin.residual, 0)
    np.testing.assert_allclose(later.obs[step, world], fresh.obs, atol=1e-5)
    assert int(twin.frame) != 0 or float(later.reward[step, world]) != 0  # the reward is the ended episode's last


def test_episode_metrics_add_up_and_start_anew(rollout):
    _, later = rollout
    done, reward = np.asarray(later.done), np.asarray(later.reward)
    lengths, sums = (np.asarray(later.info["episode_metrics"][name]) for name in ("length", "sum_reward"))
    for world in range(WORLDS):
        begin = 0
        for end in np.flatnonzero(done[:, world]):
            assert lengths[end, world] == end + 1 - begin
            assert sums[end, world] == pytest.approx(reward[begin : end + 1, world].sum(), rel=1e-4)
            begin = end + 1
    np.testing.assert_array_equal(later.info["episode_done"], done)


def test_worlds_draw_for_themselves(rollout):
    first, _ = rollout
    assert len({int(f) for f in first.pipeline_state.frame}) > WORLDS / 3
