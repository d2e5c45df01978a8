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


@pytest.fixture(scope="module")
def caught(world: World) -> tuple[Caught, jax.Array]:
    """Three worlds; the second one's hand is sent off at a speed that no engine bears. Also its qvel."""
    parallel = ParallelEnv(world.env, guard=True)
    state = parallel.reset(jax.random.split(jax.random.key(0), 3))
    twin = twin_of(state)
    fast = twin.physics.qvel.at[1, 7].set(1e11)
    physics = jax.vmap(world.env.engine.reset)(twin.physics.variant, twin.physics.qpos, fast, jnp.zeros((3, 26)))
    state = replace(state, pipeline_state=replace(twin, physics=physics))
    state = jax.jit(parallel.step)(state, jnp.full((3, 26), 0.5))
    assert state.done.tolist() == [0, 1, 0]
    state = jax.jit(parallel.step)(state, jnp.zeros((3, 26)))
    return state.info["caught"], fast


def test_the_state_before_the_step_is_kept(caught: tuple[Caught, jax.Array]):
    kept, fast = caught
    assert kept.count.tolist() == [0, 1, 0]
    np.testing.assert_array_equal(kept.twin.physics.qvel[1], fast[1])
    np.testing.assert_array_equal(kept.action[1], np.full(26, 0.5, np.float32))


def test_it_is_written_once_and_steps_again(caught: tuple[Caught, jax.Array], world: World, tmp_path: Path):
    kept, fast = caught
    log = UnstableLog(tmp_path / "unstable", world.env)
    (path,) = log.write(64, kept)
    assert path.name == "000000000064-1.npz"
    assert log.write(96, kept) == []
    found = load_unstable(path)
    np.testing.assert_array_equal(found.qvel, fast[1])
    low, high = world.env.engine.models[0].actuator_ctrlrange.T
    assert np.all(found.targets >= low - 1e-6)
    assert np.all(found.targets <= high + 1e-6)
    path_again = step_again(world.env.engine.models[found.demonstration], found, world.env.engine.substeps)
    assert len(path_again) <= world.env.engine.substeps, "it diverges again, before the control step is over"
    np.testing.assert_allclose(path_again[0], found.qpos)


def test_another_file_is_refused(tmp_path: Path):
    np.savez(tmp_path / "x.npz", schema="mjx-hand/policy/1")
    with pytest.raises(InputError, match="expected mjx-hand/unstable/1"):
        load_unstable(tmp_path / "x.npz")
