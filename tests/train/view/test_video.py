import re
import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from envs.evaluation.evaluate import Evaluation
from envs.evaluation.rollout import Rollouts
from envs.tracking import TrackingEnv
from mjx_hand.pytree import replace
from mjx_hand.view.video import video as view_video
from mjx_hand.view.video.renderer import RendererUnavailable
from train.experiment.evaluate_seeds import median_and_worst
from train.view.video import film, side_by_side

FRAMES = 9


@pytest.fixture(scope="module")
def rollouts(env: TrackingEnv) -> Rollouts:
    """The reference itself, without physics: what is drawn left is then what is drawn right."""
    targets = np.asarray(env.reference.targets)[:, :FRAMES]
    pose = np.asarray(env.reference.object_pose)[:, :FRAMES]
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
        contact=np.zeros((count, FRAMES, 16, 6)),
        least_force=np.ones(count),
        counted=counted,
        held=~counted,
        reward=np.zeros((count, FRAMES)),
        fps=env.fps,
    )


def frames_of(path: Path) -> tuple[float, np.ndarray]:
    """Frames a second, and every frame; decoded without imageio's reader, which forks a process that JAX runs in."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    found = re.search(rb"Video: .* (\d+)x(\d+)\D.* ([\d.]+) fps", done.stderr)
    assert found is not None, done.stderr
    width, height, fps = (float(number) for number in found.groups())
    return fps, np.frombuffer(done.stdout, np.uint8).reshape(-1, int(height), int(width), 3)


def test_demonstration_and_twin_stand_side_by_side(env: TrackingEnv, rollouts: Rollouts, tmp_path):
    try:
        side_by_side(env, rollouts, 0, tmp_path / "twin.mp4")
    except RendererUnavailable as error:
        pytest.skip(str(error))
    fps, frames = frames_of(tmp_path / "twin.mp4")
    # 8 of 9 frames count; at 50 frames a second every other one is shown, so that the video keeps time.
    assert frames.shape == (4, 480, 964, 3)
    assert fps == pytest.approx(env.fps / 2)
    below = slice(60, None)  # captions differ
    left, right = frames[:, below, :480].astype(int), frames[:, below, 484:].astype(int)
    assert left.std() > 10, "there is something to see"
    assert np.abs(left - right).mean() < 3, "the reference stands beside itself"


def test_forces_are_drawn_as_arrows(env: TrackingEnv, rollouts: Rollouts, tmp_path):
    """A force of 10 N from behind the object changes the twin's pictures, and no others."""
    contact = rollouts.contact.copy()
    contact[0, :, 15, :3] = [0.0, 0.0, -10.0]
    contact[0, :, 15, 3:] = rollouts.object_pose[0, :, :3] + [0, 0, 0.02]
    films = []
    for name, forces in (("without", rollouts.contact), ("with", contact)):
        try:
            side_by_side(env, replace(rollouts, contact=forces), 0, tmp_path / f"{name}.mp4")
        except RendererUnavailable as error:
            pytest.skip(str(error))
        films.append(frames_of(tmp_path / f"{name}.mp4")[1].astype(int))
    change = np.abs(films[0] - films[1]).max(axis=-1) > 60
    assert change[:, :, 484:].sum() > 200
    assert change[:, :, :480].sum() < 20


def scored(errors: list[float], failed: tuple[int, ...] = ()) -> Evaluation:
    count = len(errors)
    failure = tuple("rotated" if k in failed else "" for k in range(count))
    return Evaluation(np.arange(count), {"tracking_error_cm": np.array(errors)}, failure)


def test_the_median_and_the_worst_are_of_all_seeds():
    chosen = median_and_worst({3: scored([1.0, 9.0]), 5: scored([2.0, 0.5, 4.0])})
    assert chosen == {"median": (5, 0), "worst": (3, 1)}


def test_a_failure_is_worse_than_a_success_with_a_larger_error():
    chosen = median_and_worst({0: scored([1.0, 2.0, 1.5, 0.5], failed=(0, 2))})
    assert chosen["worst"] == (0, 2)
    assert chosen["median"] == (0, 2)  # of 0.5, 1, 1.5 and 2 the third


def test_a_page_gets_a_film(env: TrackingEnv, rollouts: Rollouts, tmp_path):
    made = film(env, rollouts, 0, tmp_path / "twin.mp4", "Left and right.")
    if made.path is None:
        pytest.skip(made.missing)
    assert (made.path, made.caption, made.missing) == (tmp_path / "twin.mp4", "Left and right.", "")
    assert made.path.stat().st_size > 1000


def test_a_page_is_told_why_there_is_no_film(env: TrackingEnv, rollouts: Rollouts, tmp_path, monkeypatch):
    def without_graphics(*_: object, **__: object) -> None:
        raise RendererUnavailable("no OpenGL here; install libegl1")

    monkeypatch.setattr(view_video, "open_renderer", without_graphics)
    made = film(env, rollouts, 0, tmp_path / "twin.mp4", "")
    assert (made.path, made.missing) == (None, "no OpenGL here; install libegl1")
    assert list(tmp_path.iterdir()) == []
