import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.parallel import ParallelEnv
from envs.tracking import twin_of
from mjx_hand.errors import InputError
from mjx_hand.pytree import replace
from train.config import Config
from train.experiment import World
from train.learner import Learner, LearnerState


@pytest.fixture(scope="module")
def learner(tiny: Config, world: World) -> Learner:
    return Learner(ParallelEnv(world.env), tiny.ppo)


def different(a: LearnerState, b: LearnerState) -> list[str]:
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


def test_it_compiles_once(learner: Learner):
    state = learner.initial(0)
    for _ in range(3):
        state, _ = learner.update(state, 0.0)
    assert learner.update._cache_size() == 1  # type: ignore[attr-defined]


def test_a_state_that_was_put_away_goes_on_as_if_it_had_not_been(learner: Learner):
    state, _ = learner.update(learner.initial(0), 0.0)
    aside = jax.tree.map(np.array, jax.device_get(state))
    on, _ = learner.update(state, 0.0)
    back, _ = learner.update(learner.placed(aside), 0.0)
    assert different(on, back) == []


def test_diverged_simulations_are_counted(tiny: Config, world: World):
    learner = Learner(ParallelEnv(world.env), tiny.ppo)
    state = learner.initial(0)
    twin = twin_of(state.worlds)
    lost = replace(twin, residual=twin.residual.at[1, 7].set(jnp.nan))  # a finger is told to go nowhere
    after, metrics = learner.update(replace(state, worlds=replace(state.worlds, pipeline_state=lost)), 0.0)
    assert int(after.unstable) == 1
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(jax.device_get((after.params, after.worlds.obs))))
    assert float(metrics["episode/ended"]) >= 1


def test_worlds_that_cannot_be_shared_are_refused(tiny: Config, world: World):
    odd = dataclasses.replace(tiny.ppo)
    object.__setattr__(odd, "num_envs", 5)  # what the configuration itself would refuse, but for one device
    with pytest.raises(InputError, match=r"ppo.num_envs is 5, which 1 devices cannot share .* multiple of 2"):
        Learner(ParallelEnv(world.env), odd)
