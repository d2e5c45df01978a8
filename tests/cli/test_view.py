"""`mjx-hand view`: what it makes of each kind of file. That the page shows a hand, `tests/view/browser/test_viewer.py`
sees."""

from pathlib import Path

import numpy as np
import pytest

from mjx_hand.capture.markers.marker_recording import MarkerRecording, save_recording
from mjx_hand.cli import view as command
from mjx_hand.cli.main import main
from mjx_hand.errors import InputError
from mjx_hand.motion import save_joint_motion, save_motion
from mjx_hand.view.browser.scene import Scene
from mjx_hand.view.browser.viewer import Viewer
from tests.capture.keypoints.grips import FPS, FRAMES, grip, keypoints_of
from tests.cli.test_info import joint_motion


def scene_of(path: Path, **said: str) -> Scene:
    options = {"side": None, "sequence": None, "fps": None, "up": "+z", "mano": None}
    return command.recording_scene(path, **(options | said))  # type: ignore[arg-type]


def test_motions_and_joint_motions(tmp_path):
    save_motion(grip("left"), tmp_path / "motion.npz")
    scene = scene_of(tmp_path / "motion.npz", up="+y")
    assert [layer.name for layer in scene.layers] == ["hand", "rigid twin"]
    assert scene.up == "+y"
    save_joint_motion(joint_motion(), tmp_path / "angles.npz")
    scene = scene_of(tmp_path / "angles.npz")
    assert [layer.name for layer in scene.layers] == ["rigid twin", "hand"]
    with pytest.raises(InputError, match="says its side and rate itself"):
        scene_of(tmp_path / "angles.npz", side="left")


def test_keypoints_lie_over_the_hand_that_was_fitted_to_them(tmp_path):
    np.savez(tmp_path / "hand.npz", joints=keypoints_of(grip()), fps=FPS)
    scene = scene_of(tmp_path / "hand.npz")
    assert [layer.name for layer in scene.layers] == ["hand", "rigid twin", "keypoints"]
    assert scene.curves[0].values.max() < 3.0  # mm


def test_the_command_serves_what_was_asked_for(tmp_path, capsys, monkeypatch):
    shown = []
    monkeypatch.setattr(Viewer, "wait", lambda viewer: shown.append(viewer.scene))
    motion = grip()
    save_motion(motion, tmp_path / "motion.npz")
    markers = MarkerRecording(
        fps=FPS,
        positions=motion.wrist_position[:, None] + np.zeros((FRAMES, 2, 3)),
        visible=np.ones((FRAMES, 2), bool),
        names=("a", "b"),
    )
    save_recording(markers, tmp_path / "markers.npz")
    options = ["--markers", str(tmp_path / "markers.npz"), "--port", "0"]
    assert main(["view", str(tmp_path / "motion.npz"), *options]) == 0
    assert "open http://localhost:" in capsys.readouterr().out
    assert [layer.name for layer in shown[0].layers] == ["hand", "rigid twin", "markers"]
    assert main(["view", str(tmp_path / "absent.npz")]) == 2
    assert "no such file" in capsys.readouterr().err
