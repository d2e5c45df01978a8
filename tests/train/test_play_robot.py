"""The viewer shows a robot's rollout where MuJoCo has it, and beside it the person's hand as recorded."""

import dataclasses
import sys
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest
from scipy.spatial import KDTree

from envs.demonstrations.twin_hands import twins
from envs.evaluation.evaluate import Evaluation
from envs.evaluation.rollout import Rollouts
from envs.reference import demonstrated_targets
from envs.scene import demonstration_spec
from envs.tracking import TrackingEnv
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.motion.demonstration import load_demonstration
from mjx_hand.view.browser.hand_scene import SKIN, TWIN, twin_layer
from mjx_hand.view.browser.scene import Layer, MeshLayer, PointLayer
from mjx_hand.view.browser.viewer import Viewer
from train import play
from train.experiment.bundled_policies import demonstration_path
from train.experiment.setup import load_env, rolled_out
from train.learning.unstable import Unstable, step_again
from train.play import viewer
from train.settings.config import Config
from train.settings.options import Play
from train.view.unstable_scene import unstable_scene

Own = tuple[TrackingEnv, Rollouts, Evaluation]


@pytest.fixture(scope="module")
def own(allegro: Config) -> Own:
    env = load_env(allegro, "heldout")
    return env, *rolled_out(allegro, env)[1:]


@pytest.fixture(scope="module")
def playing(allegro: Config) -> Iterator[Viewer]:
    shown = viewer(dataclasses.replace(allegro, play=Play(port=0)))
    yield shown
    shown.close()


def meshes(layers: tuple[Layer, ...], name: str) -> MeshLayer:
    found = next(layer for layer in layers if layer.name == name)
    assert isinstance(found, MeshLayer)
    return found


def in_world(layer: MeshLayer, frame: int) -> np.ndarray:
    places = layer.transforms[frame]
    return np.concatenate([v @ t[:3, :3].T + t[:3, 3] for (v, _), t in zip(layer.meshes, places, strict=True)])


def seen_by_mujoco(env: TrackingEnv, qpos: np.ndarray) -> np.ndarray:
    """Corners of the robot's visible meshes in the world, geom by geom."""
    model = demonstration_spec(env.demonstrations[0], env.hands[0], visual=True).compile()
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    corners = []
    for k in range(model.ngeom):
        if model.geom(k).name.partition("_visual")[1]:
            mesh = model.mesh(model.geom_dataid[k])
            first = int(mesh.vertadr[0])
            corners.append(model.mesh_vert[first : first + int(mesh.vertnum[0])] @ data.geom_xmat[k].reshape(3, 3).T)
            corners[-1] = corners[-1] + data.geom_xpos[k]
    return np.concatenate(corners)


def same_places(one: np.ndarray, other: np.ndarray) -> bool:
    away = [KDTree(a).query(b)[0].max() for a, b in ((one, other), (other, one))]
    return max(away) < 1e-5


def test_the_robot_is_where_the_rollout_has_it(playing: Viewer, own: Own):
    env, rollouts, scores = own
    twin = meshes(playing.scene.layers, "twin")
    frames = playing.scene.num_frames
    assert frames == rollouts.counted[0].sum() == env.demonstrations[0].num_frames
    assert twin.shown
    for frame in (0, frames // 2, frames - 1):
        assert same_places(in_world(twin, frame), seen_by_mujoco(env, rollouts.qpos[0, frame].astype(float)))
    thing = meshes(playing.scene.layers, "object").transforms[:, 0, :3, 3]
    np.testing.assert_allclose(thing, rollouts.object_pose[0, :frames, :3], atol=1e-6)
    error = np.linalg.norm(thing - rollouts.object_reference[0, :frames, :3], axis=1)
    np.testing.assert_allclose(playing.scene.curves[0].values, 100 * error, atol=1e-3)
    error_cm = scores.scores["tracking_error_cm"][0]
    assert playing.scene.title == f"pinch 0 on allegro: followed to the end, {error_cm:.2f} cm"


def test_beside_it_is_the_persons_hand_as_recorded(playing: Viewer, own: Own):
    """Not where the robot is told to be, which is another layer, hidden at first."""
    recorded, (env, *_) = load_demonstration(demonstration_path("pinch")), own
    shown = meshes(playing.scene.layers, "demonstration")
    wanted = twin_layer(recorded.motion, twins([recorded])[0])
    np.testing.assert_allclose(shown.transforms, wanted.transforms, atol=1e-6)
    np.testing.assert_allclose(shown.transforms[:, 0, :3, 3], recorded.motion.wrist_position, atol=1e-6)
    assert (shown.colour, meshes(playing.scene.layers, "twin").colour) == (SKIN, TWIN)
    assert shown.opacity < 1
    told = meshes(playing.scene.layers, "demonstration on the twin")
    assert not told.shown
    model, frame = env.models[0], 100
    hand = hand_coordinates(model, demonstrated_targets(env.demonstrations[0])[frame])
    assert same_places(in_world(told, frame), seen_by_mujoco(env, np.concatenate([hand, recorded.object_pose[frame]])))
    np.testing.assert_allclose(
        meshes(playing.scene.layers, "demonstrated object").transforms[:, 0, :3, 3],
        recorded.object_pose[:, :3],
        atol=1e-6,
    )


def test_forces_are_shown_where_fingers_press(playing: Viewer, own: Own):
    env, rollouts, _ = own
    forces = next(layer for layer in playing.scene.layers if isinstance(layer, PointLayer))
    links = len(env.body.touching_links)
    assert forces.points.shape[1] == 2 * links
    middle = playing.scene.num_frames // 2
    pressing = np.linalg.norm(rollouts.contact[0, middle, :, :3], axis=1) > 0.05
    assert pressing.sum() >= 2, "thumb and another"
    np.testing.assert_array_equal(np.isfinite(forces.points[middle, :links, 0]), pressing)


def test_a_robots_simulation_that_diverged_is_shown(own: Own):
    env = own[0]
    start = env.tables.starts
    targets = np.asarray(env.reference.controls)[0, 40].astype(float)
    targets[8] = np.nan
    qpos, qvel = (np.asarray(a[0, 40], float) for a in (start.qpos, start.qvel))
    unstable = Unstable(1, 64, 2, 0, 40, qpos, qvel, targets)
    scene = unstable_scene(unstable, env, "pinch")
    path = step_again(env.engine.models[0], unstable, env.engine.substeps)
    assert scene.num_frames == len(path)
    assert same_places(in_world(meshes(scene.layers, "twin"), 0), seen_by_mujoco(env, path[0]))
    assert "targets [8] are no numbers" in scene.title


def test_a_hand_that_the_run_was_not_trained_with(
    allegro: Config, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    for hand in ("shadow", "human"):
        monkeypatch.setattr(sys, "argv", ["play", f"out={allegro.out}", f"hand={hand}"])
        with pytest.raises(SystemExit, match="2"):
            play.command_line()
        (line,) = capsys.readouterr().err.splitlines()
        assert f"holds a training with hand=allegro, now {hand}; leave out that option" in line
