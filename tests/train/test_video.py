import re
import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from envs.evaluation import Evaluation
from envs.rollout import Rollouts
from mjx_hand.view import video as view_video
from mjx_hand.view.renderer import RendererUnavailable
from train import demo
from train.checkpoint import Checkpoint
from train.evaluate import POLICY, Results
from train.experiment import World
from train.video import side_by_side

FRAMES = 9


@pytest.fixture(scope="module")
def rollouts(world: World) -> Rollouts:
    """The reference itself, without physics: what is drawn left is then what is drawn right."""
    targets = np.asarray(world.env.reference.targets)[:, :FRAMES]
    pose = np.asarray(world.env.reference.object_pose)[:, :FRAMES]
    count = len(targets)
    joints, tips = np.zeros((count, FRAMES, 16, 3)), np.zeros((count, FRAMES, 5, 3))
    counted = np.ones((count, FRAMES), bool)
    counted[:, -1] = False
    return Rollouts(
        demonstration=np.arange(count),
        qpos=np.concatenate([targets, pose], axis=-1),
        object_pose=pose,
        object_reference=pose,
        joints=joints,
        joints_reference=joints,
        tips=tips,
        tips_reference=tips,
        counted=counted,
        held=~counted,
        reward=np.zeros((count, FRAMES)),
        fps=world.env.fps,
    )


@pytest.fixture(scope="module")
def results(world: World, rollouts: Rollouts) -> Results:
    evaluation = Evaluation(np.arange(1), {"tracking_error_cm": np.array([1.0])}, ("",))
    checkpoint = Checkpoint({}, {}, 0, 0.0, "tiny", 1)
    return Results(world, checkpoint, {POLICY: rollouts}, {POLICY: evaluation})


def frames_of(path: Path) -> tuple[float, np.ndarray]:
    """Frames a second, and every frame; decoded without imageio's reader, which forks a process that JAX runs in."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    found = re.search(rb"Video: .* (\d+)x(\d+)\D.* ([\d.]+) fps", done.stderr)
    assert found is not None, done.stderr
    width, height, fps = (float(number) for number in found.groups())
    return fps, np.frombuffer(done.stdout, np.uint8).reshape(-1, int(height), int(width), 3)


def test_demonstration_and_twin_stand_side_by_side(world: World, rollouts: Rollouts, tmp_path):
    try:
        side_by_side(world, rollouts, 0, tmp_path / "twin.mp4")
    except RendererUnavailable as error:
        pytest.skip(str(error))
    fps, frames = frames_of(tmp_path / "twin.mp4")
    # 8 of 9 frames count; at 50 frames a second every other one is shown, so that the video keeps time.
    assert frames.shape == (4, 480, 964, 3)
    assert fps == pytest.approx(world.env.fps / 2)
    below = slice(60, None)  # captions differ
    left, right = frames[:, below, :480].astype(int), frames[:, below, 484:].astype(int)
    assert left.std() > 10, "there is something to see"
    assert np.abs(left - right).mean() < 3, "the reference stands beside itself"


def test_the_demo_shows_the_rollout_of_median_error(results: Results, tmp_path):
    path, missing = demo._video(results, tmp_path / "twin.mp4")
    if path is None:
        pytest.skip(missing)
    assert (path, missing) == (tmp_path / "twin.mp4", "")
    assert path.stat().st_size > 1000


def test_the_demo_says_why_there_is_no_video(results: Results, tmp_path, monkeypatch):
    def without_graphics(*_: object, **__: object) -> None:
        raise RendererUnavailable("no OpenGL here; install libegl1")

    monkeypatch.setattr(view_video, "open_renderer", without_graphics)
    assert demo._video(results, tmp_path / "twin.mp4") == (None, "no OpenGL here; install libegl1")
    assert list(tmp_path.iterdir()) == []
