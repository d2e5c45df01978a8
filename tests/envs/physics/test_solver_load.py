import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.agreement import free_and_gripping
from envs.physics import make_engine
from envs.physics.solver_load import solver_load
from mjx_hand.errors import InputError

SUBSTEPS, STEPS = 2, 2


def by_hand(engine, worlds):
    """The C engine's own counts at each step of each world: iterations, rows, contacts."""
    counts = []
    for world, variant in enumerate(worlds.variant):
        model = engine.models[variant]
        data = mujoco.MjData(model)
        data.qpos, data.qvel = worlds.qpos[world], worlds.qvel[world]
        for ctrl in worlds.controls[:STEPS, world]:
            data.ctrl = ctrl
            for _ in range(SUBSTEPS):
                mujoco.mj_step(model, data)
                acting = data.ncon - np.sum(data.contact.exclude > 0)
                counts.append((data.solver_niter[0], data.nefc, acting))
    return np.array(counts, float)


def loaded(engine, worlds):
    start = jax.jit(jax.vmap(engine.reset))(worlds.variant, worlds.qpos, worlds.qvel, worlds.controls[0])
    return solver_load(engine, start, jnp.asarray(worlds.controls[:STEPS]))


@pytest.mark.slow
def test_warp_has_the_load_of_the_c_engine(env):
    pytest.importorskip("warp", reason="the extra mjx-hand[warp] is not installed")
    engine, worlds = make_engine("warp", env.models, SUBSTEPS), free_and_gripping(env)
    load, counts = loaded(engine, worlds), by_hand(engine, worlds)
    np.testing.assert_allclose(load.rows, counts[:, 1].mean(), rtol=0.05)
    np.testing.assert_allclose(load.contacts, counts[:, 2].mean(), rtol=0.05)
    np.testing.assert_allclose(load.most_rows, counts[:, 1].max(), atol=4)
    assert load.iterations == pytest.approx(counts[:, 0].mean(), rel=0.3)
    assert load.most_rows < load.room


@pytest.mark.slow
def test_mjx_has_the_contacts_of_the_c_engine_and_does_not_tell_iterations(env):
    engine, worlds = make_engine("mjx", env.models, SUBSTEPS), free_and_gripping(env)
    load, counts = loaded(engine, worlds), by_hand(engine, worlds)
    np.testing.assert_allclose(load.rows, counts[:, 1].mean(), rtol=0.05)
    np.testing.assert_allclose(load.contacts, counts[:, 2].mean(), rtol=0.05)
    assert load.iterations is None
    assert load.most_rows < load.room


def test_an_engine_that_does_not_tell_is_refused(env):
    worlds = free_and_gripping(env)
    with pytest.raises(InputError, match="'native' does not tell what its solver does; valid: mjx, warp"):
        loaded(env.engine, worlds)
