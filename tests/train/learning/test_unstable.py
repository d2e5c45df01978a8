import dataclasses
import urllib.request
from pathlib import Path

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.parallel import Caught, ParallelEnv
from envs.tracking import TrackingEnv
from envs.twin import twin_of
from mjx_hand.errors import InputError
from mjx_hand.pytree import replace
from mjx_hand.view.browser.scene import MeshLayer
from train.learning.unstable import UnstableLog, load_unstable, step_again
from train.play import viewer
from train.settings.config import Config
from train.settings.options import Play
from train.view.unstable_scene import unstable_scene

FINGER = 7  # any target of a hinge


@pytest.fixture(scope="module")
def caught(env: TrackingEnv) -> Caught:
    """Three worlds; a finger of the second one is told to go nowhere. One step, and another."""
    parallel = ParallelEnv(env, guard=True)
    state = parallel.reset(jax.random.split(jax.random.key(0), 3))
    twin = twin_of(state)
    lost = replace(twin, residual=twin.residual.at[1, FINGER].set(jnp.nan))
    step = jax.jit(parallel.step)
    state = step(replace(state, pipeline_state=lost), jnp.full((3, 26), 0.5))
    assert state.done.tolist() == [0, 1, 0]
    assert all(np.isfinite(leaf).all() for leaf in (state.obs, state.reward, twin_of(state).residual))
    return step(state, jnp.zeros((3, 26))).info["caught"]


@pytest.mark.slow
def test_the_state_before_the_step_is_kept(caught: Caught):
    assert caught.count.tolist() == [0, 1, 0]
    assert np.flatnonzero(np.isnan(caught.twin.residual[1])).tolist() == [FINGER]
    np.testing.assert_array_equal(caught.action[1], np.full(26, 0.5, np.float32))


def test_it_is_written_once_and_steps_again(caught: Caught, env: TrackingEnv, tmp_path: Path):
    log = UnstableLog(tmp_path / "unstable", env, seed=3)
    (path,) = log.write(64, caught)
    assert path.name == "000000000064-1.npz"
    assert log.write(96, caught) == []
    found = load_unstable(path)
    assert (found.seed, found.steps, found.world, found.demonstration) == (3, 64, 1, 0)
    np.testing.assert_array_equal(found.qpos, caught.twin.physics.qpos[1])
    assert np.flatnonzero(np.isnan(found.targets)).tolist() == [FINGER]
    model, substeps = env.engine.models[found.demonstration], env.engine.substeps
    assert len(step_again(model, found, substeps)) == 1, "it diverges again, in the first physics step"
    told = np.where(np.isnan(found.targets), 0.0, found.targets)
    low, high = model.actuator_ctrlrange.T
    assert np.all((told >= low - 1e-6) & (told <= high + 1e-6))
    mended = step_again(model, replace(found, targets=told), substeps)
    assert mended.shape == (substeps + 1, model.nq)
    assert np.isfinite(mended).all()


def test_another_file_is_refused(tmp_path: Path):
    np.savez(tmp_path / "x.npz", schema="mjx-hand/policy/1")
    with pytest.raises(InputError, match="expected mjx-hand/unstable/2"):
        load_unstable(tmp_path / "x.npz")


def test_the_viewer_shows_every_physics_step(caught: Caught, env: TrackingEnv, tiny: Config, tmp_path: Path):
    (path,) = UnstableLog(tmp_path, env, seed=3).write(64, caught)
    found = load_unstable(path)
    model, substeps = env.engine.models[0], env.engine.substeps
    mended = replace(found, targets=np.where(np.isnan(found.targets), 0.0, found.targets))
    scene = unstable_scene(mended, env, "tiny")
    assert scene.num_frames == substeps + 1
    assert scene.fps == pytest.approx(1 / model.opt.timestep)
    assert f"seed 3, world 1 at 64 steps: demonstration 0, frame {found.frame}; 5 of 5 physics steps" in scene.title
    layers = {layer.name: layer for layer in scene.layers}
    data = mujoco.MjData(model)
    for step, qpos in enumerate(step_again(model, mended, substeps)):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        object_layer, twin = layers["object"], layers["twin"]
        assert isinstance(object_layer, MeshLayer)
        assert isinstance(twin, MeshLayer)
        np.testing.assert_allclose(object_layer.transforms[step, 0, :3, 3], qpos[26:29], atol=1e-6)
        tip = data.body("index3").xpos
        nearest = np.linalg.norm(twin.transforms[step, :, :3, 3] - tip, axis=1).min()
        assert nearest < 1e-5, "the twin's links stand where the engine has them"


def test_the_browser_gets_it_by_name(caught: Caught, env: TrackingEnv, trained: object, tiny: Config, tmp_path: Path):
    (path,) = UnstableLog(tmp_path, env, seed=3).write(64, caught)
    playing = dataclasses.replace(tiny, play=Play(port=0, unstable=str(path)))
    shown = viewer(playing)
    try:
        assert shown.scene.num_frames == 1
        assert "0 of 5 physics steps; targets [7] are no numbers" in shown.scene.title
        assert urllib.request.urlopen(shown.url, timeout=10).status == 200
    finally:
        shown.close()
    alien = tmp_path / "alien.npz"
    with np.load(path) as arrays:
        np.savez(alien, **{**arrays, "demonstration": 7})
    with pytest.raises(InputError, match=r"follows demonstration 7 .* 'tiny' has 1 of"):
        viewer(dataclasses.replace(playing, play=Play(port=0, unstable=str(alien))))
