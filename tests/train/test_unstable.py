from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.parallel import Caught, ParallelEnv
from envs.tracking import twin_of
from mjx_hand.errors import InputError
from mjx_hand.pytree import replace
from train.experiment import World
from train.unstable import UnstableLog, load_unstable, step_again

FINGER = 7  # any target of a hinge


@pytest.fixture(scope="module")
def caught(world: World) -> Caught:
    """Three worlds; a finger of the second one is told to go nowhere. One step, and another."""
    parallel = ParallelEnv(world.env, guard=True)
    state = parallel.reset(jax.random.split(jax.random.key(0), 3))
    twin = twin_of(state)
    lost = replace(twin, residual=twin.residual.at[1, FINGER].set(jnp.nan))
    step = jax.jit(parallel.step)
    state = step(replace(state, pipeline_state=lost), jnp.full((3, 26), 0.5))
    assert state.done.tolist() == [0, 1, 0]
    assert all(np.isfinite(leaf).all() for leaf in (state.obs, state.reward, twin_of(state).residual))
    return step(state, jnp.zeros((3, 26))).info["caught"]


def test_the_state_before_the_step_is_kept(caught: Caught):
    assert caught.count.tolist() == [0, 1, 0]
    assert np.flatnonzero(np.isnan(caught.twin.residual[1])).tolist() == [FINGER]
    np.testing.assert_array_equal(caught.action[1], np.full(26, 0.5, np.float32))


def test_it_is_written_once_and_steps_again(caught: Caught, world: World, tmp_path: Path):
    log = UnstableLog(tmp_path / "unstable", world.env)
    (path,) = log.write(64, caught)
    assert path.name == "000000000064-1.npz"
    assert log.write(96, caught) == []
    found = load_unstable(path)
    np.testing.assert_array_equal(found.qpos, caught.twin.physics.qpos[1])
    assert np.flatnonzero(np.isnan(found.targets)).tolist() == [FINGER]
    model, substeps = world.env.engine.models[found.demonstration], world.env.engine.substeps
    assert len(step_again(model, found, substeps)) == 1, "it diverges again, in the first physics step"
    told = np.where(np.isnan(found.targets), 0.0, found.targets)
    low, high = model.actuator_ctrlrange.T
    assert np.all((told >= low - 1e-6) & (told <= high + 1e-6))
    mended = step_again(model, replace(found, targets=told), substeps)
    assert mended.shape == (substeps + 1, model.nq)
    assert np.isfinite(mended).all()


def test_another_file_is_refused(tmp_path: Path):
    np.savez(tmp_path / "x.npz", schema="mjx-hand/policy/1")
    with pytest.raises(InputError, match="expected mjx-hand/unstable/1"):
        load_unstable(tmp_path / "x.npz")
