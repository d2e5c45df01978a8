import dataclasses
import re
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.parallel import ParallelEnv
from envs.tracking import TrackingEnv
from envs.twin import twin_of
from mjx_hand.errors import InputError
from mjx_hand.pytree import replace
from train.learning.learner import Learner
from train.settings.config import Config


@pytest.fixture(scope="module")
def learner(tiny: Config, env: TrackingEnv) -> Learner:
    return Learner(ParallelEnv(env), tiny.ppo)


def different(a: Any, b: Any) -> list[str]:
    pairs = zip(jax.tree_util.tree_leaves_with_path(a), jax.tree_util.tree_leaves_with_path(b), strict=True)
    return [jax.tree_util.keystr(p) for (p, x), (_, y) in pairs if not np.array_equal(np.asarray(x), np.asarray(y))]


def test_a_seed_is_a_state(learner: Learner):
    first, again, other = learner.initial(0), learner.initial(0), learner.initial(1)
    assert different(first, again) == []
    changed = different(first, other)
    for part in (".params.policy", ".params.value", ".key", ".worlds.info['rng']"):
        assert any(name.startswith(part) for name in changed), part


def test_an_update_changes_networks_moments_worlds_and_key(learner: Learner):
    before = jax.device_get(learner.initial(0))
    after, metrics = learner.update(learner.initial(0), 0.0)
    changed = different(before, jax.device_get(after))
    for part in (".params.policy", ".params.value", ".optimizer", ".worlds.obs", ".key", ".updates"):
        assert any(name.startswith(part) for name in changed), part
    assert int(after.updates) == 1
    assert np.isfinite(float(metrics["training/total_loss"]))
    assert int(after.optimizer[1][0].count) == 4, "2 minibatches, twice"


@pytest.fixture(scope="module")
def other(tiny: Config, env: TrackingEnv) -> ParallelEnv:
    """Another set of the same size: the same demonstration with a lighter object that stands elsewhere."""
    (demonstration,) = env.demonstrations
    thing = replace(demonstration.object, mass=0.5 * demonstration.object.mass)
    shift = np.array([0.01, 0.0, 0.0])
    moved = replace(
        demonstration,
        object=thing,
        object_pose=demonstration.object_pose + np.pad(shift, (0, 4)),
        support_position=demonstration.support_position + shift,
        motion=replace(demonstration.motion, wrist_position=demonstration.motion.wrist_position + shift),
    )
    return ParallelEnv(TrackingEnv([moved], env.hands, env.engine.name, env.task))


def test_another_set_of_the_same_size_does_not_compile_again(learner: Learner, other: ParallelEnv, tiny: Config):
    """Within a process, where it is compiled once, and from process to process, where the program's text counts."""
    compiled = []

    def listen(event: str, duration_secs: float, **_: Any) -> None:
        compiled.append(event)

    learner.update(learner.initial(0), 0.0)
    jax.monitoring.register_event_duration_secs_listener(listen)
    try:
        own, _ = learner.update(learner.initial(0), 0.0)
        placed = learner.placed_tables(other.env.tables)
        compiled.clear()
        swapped, _ = jax.block_until_ready(learner.update(learner.initial(0, placed), 0.0, placed))
        assert not [event for event in compiled if "backend_compile" in event]
        second = Learner(other, tiny.ppo)
        expected, _ = second.update(second.initial(0), 0.0)
        assert [event for event in compiled if "backend_compile" in event], "the listener hears compilations"
    finally:
        jax.monitoring.clear_event_listeners()
    assert different(swapped, expected) == []
    assert different(expected.params, own.params), "another set teaches something else"
    assert learner.lowered.as_text() == second.lowered.as_text()


def test_tables_of_another_size_are_refused(learner: Learner, env: TrackingEnv):
    two = ParallelEnv(TrackingEnv(2 * list(env.demonstrations), 2 * list(env.hands), "native", env.task))
    tables = learner.placed_tables(two.env.tables)
    with pytest.raises(InputError, match=r"tables of 2 demonstrations x .* do not fit a learner for 1 dem"):
        learner.update(learner.initial(0), 0.0, tables)


def test_memory_grows_with_the_worlds(tiny: Config, learner: Learner, env: TrackingEnv):
    """A world more needs what its unroll holds, at least: observations of each step."""
    twice = Learner(ParallelEnv(env), dataclasses.replace(tiny.ppo, num_envs=2 * tiny.ppo.num_envs))
    few, many = learner.memory(), twice.memory()
    assert few is not None
    assert many is not None
    observations = tiny.ppo.num_envs * tiny.ppo.unroll_length * env.observation_size * 4
    assert many - few > observations


def test_a_state_that_was_put_away_goes_on_as_if_it_had_not_been(learner: Learner):
    state, _ = learner.update(learner.initial(0), 0.0)
    aside = jax.tree.map(np.array, jax.device_get(state))
    on, _ = learner.update(state, 0.0)
    back, _ = learner.update(learner.placed(aside), 0.0)
    assert different(on, back) == []


def test_diverged_simulations_are_counted(tiny: Config, env: TrackingEnv):
    learner = Learner(ParallelEnv(env), tiny.ppo)
    state = learner.initial(0)
    twin = twin_of(state.worlds)
    lost = replace(twin, residual=twin.residual.at[1, 7].set(jnp.nan))  # a finger is told to go nowhere
    after, metrics = learner.update(replace(state, worlds=replace(state.worlds, pipeline_state=lost)), 0.0)
    assert int(after.unstable) == 1
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(jax.device_get((after.params, after.worlds.obs))))
    assert float(metrics["episode/ended"]) >= 1


def test_worlds_that_cannot_be_shared_are_refused(tiny: Config, env: TrackingEnv):
    odd = dataclasses.replace(tiny.ppo)
    object.__setattr__(odd, "num_envs", 5)  # what the configuration itself would refuse, but for one device
    with pytest.raises(InputError, match=r"ppo.num_envs is 5, which 1 devices cannot share .* multiple of 2"):
        Learner(ParallelEnv(env), odd)


def host_calls(program: str | None) -> list[str]:
    """What a program (StableHLO or HLO) exchanges with the host, by the names that XLA, JAX and this project have."""
    assert program is not None
    called = {a or b for a, b in re.findall(r'custom_call @(\w+)|custom_call_target="(\w+)"', program)}
    exchanged = set(
        re.findall(r"\b(infeed|outfeed|send|recv)(?:-done)?\(|stablehlo\.(infeed|outfeed|send|recv)\b", program)
    )
    names = called | {a or b for a, b in exchanged}
    return sorted(name for name in names if re.search("callback|host|infeed|outfeed|send|recv", name))


@pytest.fixture(scope="module")
def on_mjx(tiny: Config, env: TrackingEnv) -> Learner:
    return Learner(ParallelEnv(TrackingEnv(env.demonstrations, env.hands, "mjx", env.task)), tiny.ppo)


def test_nothing_goes_to_the_host_inside_an_update(on_mjx: Learner, learner: Learner):
    assert host_calls(on_mjx.lowered.as_text()) == []
    assert host_calls(learner.lowered.as_text()) == ["mjx_hand_host_call"], "the native engine steps on the host"


@pytest.mark.slow
def test_nothing_goes_to_the_host_inside_a_compiled_update(on_mjx: Learner, learner: Learner):
    """MJX compiles for a minute or more on a CPU."""
    assert host_calls(on_mjx.compiled.as_text()) == []
    assert host_calls(learner.compiled.as_text()) == ["mjx_hand_host_call"]
