"""`TrackingEnv` under Brax's own wrappers, which `brax.envs.training.wrap` puts around any environment."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brax.envs.wrappers.training import AutoResetWrapper, EpisodeWrapper, VmapWrapper

from envs.task import Task
from envs.tracking import TrackingEnv

WORLDS, LENGTH = 2, 12


@pytest.fixture(scope="module")
def env(demonstrations, hands):
    """Every episode begins at frame 0, where nothing can be dropped yet."""
    return TrackingEnv(demonstrations, hands, "native", Task(random_start_prob=0.0))


@pytest.fixture(scope="module")
def wrapped(env):
    return AutoResetWrapper(EpisodeWrapper(VmapWrapper(env), LENGTH, 1))


@pytest.fixture(scope="module")
def reset(wrapped):
    return jax.jit(wrapped.reset)


def test_they_step_reset_and_count_in_a_compiled_scan(env, wrapped, reset):
    keys = jax.random.split(jax.random.PRNGKey(3), WORLDS)
    first = reset(keys)

    @jax.jit
    def run(state):
        def step(state, _):
            state = wrapped.step(state, jnp.zeros((WORLDS, 26)))
            return state, (state.obs, state.reward, state.done, state.info["episode_metrics"]["sum_reward"])

        return jax.lax.scan(step, state, length=LENGTH + 1)[1]

    observations, rewards, done, sums = map(np.asarray, run(first))
    np.testing.assert_array_equal(done[LENGTH - 1], 1)
    np.testing.assert_array_equal(observations[LENGTH - 1], first.obs)  # Brax restarts where a world began
    np.testing.assert_allclose(sums[LENGTH - 1], rewards[:LENGTH].sum(axis=0), rtol=1e-5)
    np.testing.assert_allclose(sums[LENGTH], rewards[LENGTH], rtol=1e-5)

    step, state = jax.jit(env.step), jax.jit(env.reset)(keys[0])
    directly = [float((state := step(state, jnp.zeros(26))).reward) for _ in range(LENGTH)]
    np.testing.assert_allclose(rewards[:LENGTH, 0], directly, atol=1e-4)


def test_typed_keys_are_given_as_their_raw_data(wrapped, reset):
    """Brax's EpisodeWrapper takes a key's last axis for its words: of typed keys its counters lack the worlds' axis."""
    typed = jax.random.split(jax.random.key(3), WORLDS)
    raw, state = reset(jax.random.key_data(typed)), reset(typed)
    np.testing.assert_array_equal(state.obs, raw.obs)
    assert (state.info["steps"].shape, raw.info["steps"].shape) == ((), (WORLDS,))
    with pytest.raises(ValueError, match="rank should be at least 1"):
        wrapped.step(state, jnp.zeros((WORLDS, 26)))
