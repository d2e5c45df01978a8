"""Imitation draws a teleoperated hand's policy towards the expert, and fades to exactly nothing."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.commands import EXPERT
from envs.demonstrations.streamed_hand import streamed_demonstration
from envs.parallel import ParallelEnv
from envs.tracking import TrackingEnv
from train.learning.learner import Learner
from train.learning.policy import deterministic_policy
from train.settings.config import Config


@pytest.fixture(scope="module")
def live(env: TrackingEnv) -> ParallelEnv:
    task = dataclasses.replace(env.task, live=True, contacts="object", grip_force=20.0)
    streamed = [streamed_demonstration(d, seed) for seed, d in enumerate(env.demonstrations)]
    return ParallelEnv(TrackingEnv(streamed, env.hands, "native", task))


def test_the_policy_comes_nearer_to_the_expert(tiny: Config, live: ParallelEnv):
    states = jax.jit(live.reset)(jax.random.split(jax.random.key(5), 64))
    expert = np.asarray(jax.jit(live.step)(states, jnp.zeros((64, live.action_size))).info[EXPERT])
    act = deterministic_policy(tiny.ppo, live.observation_size, live.action_size)
    off = {}
    for weight in (0.0, 1.0):
        learner = Learner(live, dataclasses.replace(tiny.ppo, imitation=weight))
        state = learner.initial(0)
        for _ in range(40):
            state, _ = learner.update(state, 0.0)
        off[weight] = float(np.mean((np.asarray(act(state.params.policy, states.obs)) - expert) ** 2))
    assert off[1.0] < 0.8 * off[0.0]


def test_at_its_end_it_changes_nothing(tiny: Config, live: ParallelEnv):
    with_it, without = (Learner(live, dataclasses.replace(tiny.ppo, imitation=weight)) for weight in (1.0, 0.0))
    half = [jax.device_get(each.update(each.initial(0), 0.5)[0].params) for each in (with_it, without)]
    for a, b in zip(*(jax.tree.leaves(params) for params in half), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)
    early = [jax.device_get(each.update(each.initial(0), 0.0)[0].params.policy) for each in (with_it, without)]
    assert any(np.abs(a - b).max() > 1e-5 for a, b in zip(*map(jax.tree.leaves, early), strict=True))


def test_an_experts_action_belongs_to_the_step_and_not_to_the_next_episode(live: ParallelEnv):
    """Where an episode ends, worlds begin anew, and what is to be imitated stays that of the step that ended it."""
    env = live.env
    reset, step = jax.jit(live.reset), jax.jit(live.step)
    states = reset(jax.random.split(jax.random.key(0), 4))
    last = int(env.reference.length[0]) - 2
    at_end = jax.jit(jax.vmap(lambda k: env.start(k, jnp.asarray(last))))(jnp.zeros(4, jnp.int32))
    states = states.replace(pipeline_state=at_end.pipeline_state)  # type: ignore[attr-defined]
    after = step(states, jnp.zeros((4, env.action_size)))
    assert np.all(np.asarray(after.pipeline_state.frame) != last + 1)
    alone = jax.jit(jax.vmap(env.step))(at_end, jnp.zeros((4, env.action_size)))
    np.testing.assert_allclose(after.info[EXPERT], alone.info[EXPERT], atol=1e-6)
