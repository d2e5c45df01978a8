import dataclasses
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from envs.evaluation.roll_out import make_roll_out
from mjx_hand.errors import InputError
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.player.play_policy import play_policy
from mjx_hand.view.browser.scene import Layer, MeshLayer
from mjx_hand.view.browser.viewer import Viewer
from tests.view.browser.chromium import find_chromium, page
from train.experiment.setup import chosen_checkpoint, load_env, rolled_out
from train.export.export_policy import export_policy
from train.learning.curve import Point
from train.learning.policy import deterministic_policy
from train.play import viewer
from train.settings.config import Config
from train.settings.options import Export, Play

Trained = tuple[Path, list[Point]]


@pytest.fixture(scope="module")
def playing(trained: Trained, tiny: Config) -> Iterator[Viewer]:
    shown = viewer(dataclasses.replace(tiny, play=Play(port=0)))
    yield shown
    shown.close()


def layer(shown: Viewer, name: str) -> MeshLayer:
    found: Layer = next(layer for layer in shown.scene.layers if layer.name == name)
    assert isinstance(found, MeshLayer)
    return found


def test_it_shows_where_twin_and_object_were(playing: Viewer, tiny: Config):
    env = load_env(tiny, "heldout")
    checkpoint = chosen_checkpoint(tiny, env.observation_size)
    policy = deterministic_policy(tiny.ppo, env.observation_size, env.action_size)
    rollouts = make_roll_out(env, policy)(checkpoint.policy)
    frames = playing.scene.num_frames
    assert frames == rollouts.counted[0].sum()
    np.testing.assert_allclose(layer(playing, "twin").transforms[..., :3, 3], rollouts.joints[0, :frames], atol=1e-5)
    np.testing.assert_allclose(
        layer(playing, "demonstration").transforms[..., :3, 3], rollouts.joints_reference[0, :frames], atol=5e-3
    )
    object_transforms = layer(playing, "object").transforms[:, 0]
    np.testing.assert_allclose(object_transforms[:, :3, 3], rollouts.object_pose[0, :frames, :3], atol=1e-6)
    np.testing.assert_allclose(
        object_transforms[:, :3, :3], quaternion_matrices(rollouts.object_pose[0, :frames, 3:]), atol=1e-5
    )
    away = np.linalg.norm(rollouts.object_pose[0, :frames, :3] - rollouts.object_reference[0, :frames, :3], axis=1)
    np.testing.assert_allclose(playing.scene.curves[0].values, 100 * away, atol=1e-3)
    assert playing.scene.title.startswith("tiny 0: ")


def test_an_export_of_the_run_takes_the_same_path(trained: Trained, tiny: Config, tmp_path: Path):
    folder = export_policy(dataclasses.replace(tiny, export=Export(folder=str(tmp_path / "export"))))
    played = play_policy(folder / "policy.npz", folder / "demonstrations/000.npz")
    _, rollouts, scores = rolled_out(tiny, load_env(tiny, "heldout"))
    path = rollouts.object_pose[0, rollouts.counted[0]]
    assert np.linalg.norm(played.object_pose[:, :3] - path[:, :3], axis=1).max() < 1e-3
    assert played.success == scores.scores["manip_trans_object"][0]
    assert not (folder / "demonstrations/001.npz").exists()  # there is one, and up to three are written


def test_a_demonstration_that_is_not_there(trained: Trained, tiny: Config):
    with pytest.raises(InputError, match=r"play.demonstration is 5; there are 1, numbered from 0"):
        viewer(dataclasses.replace(tiny, play=Play(demonstration=5, port=0)))
    with pytest.raises(InputError, match=r"play.demonstration is -1"):
        Play(demonstration=-1)


@pytest.mark.slow
def test_a_browser_shows_it(playing: Viewer, tmp_path: Path):
    chromium = find_chromium()
    if chromium is None:
        pytest.skip("no Chromium to look at the page with")
    with page(chromium, playing.url, tmp_path) as opened:
        playing.show(playing.scene.num_frames // 2)
        deadline, share = time.monotonic() + 60, 0.0
        while share < 0.003 and time.monotonic() < deadline:
            time.sleep(0.5)
            red, green, blue = np.moveaxis(opened.picture()[:, :850].astype(int), -1, 0)
            share = ((red - blue > 30) & (red > green)).mean()  # the object's orange on a grey page
        if share > 0.003:
            (tmp_path / "seen").touch()
    assert (tmp_path / "seen").exists(), "no object was drawn within a minute"
