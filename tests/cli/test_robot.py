"""`mjx-hand robot`: recordings onto a robot hand, from the file to the file."""

from pathlib import Path

import numpy as np
import pytest

from mjx_hand.cli.main import main
from mjx_hand.robots.robot_motion import load_robot_motion
from tests.robots.urdfs import urdf_of


def test_keypoints_become_the_robots_joints(recordings, tmp_path, capsys):
    video, out = recordings / "mediapipe_video/joints.npz", tmp_path / "inspire.npz"
    urdf = str(urdf_of("inspire"))
    assert main(["robot", str(video), "--urdf", urdf, "--robot", "inspire", "--out", str(out)]) == 0
    assert "a right hand, 621 frames" in capsys.readouterr().out
    motion = load_robot_motion(out)
    assert motion.values.shape == (621, len(motion.joint_names))
    leader, tied = (motion.joint_names.index(f"index_{name}_joint") for name in ("proximal", "intermediate"))
    np.testing.assert_allclose(motion.values[:, tied], 1.06399 * motion.values[:, leader] - 0.04545, atol=1e-5)
    assert motion.valid.all()


def test_a_recording_without_a_wrist_gets_that_of_the_fitted_hand(recordings, tmp_path, capsys):
    leap, out = recordings / "leap_motion/pinch.npz", tmp_path / "inspire.npz"
    urdf = str(urdf_of("inspire"))
    assert main(["robot", str(leap), "--urdf", urdf, "--robot", "inspire", "--out", str(out)]) == 0
    assert "a right hand, 311 frames" in capsys.readouterr().out
    motion = load_robot_motion(out)
    assert np.ptp(motion.values[motion.valid], axis=0).max() > 0.2  # the fingers pinch
    assert main(["info", str(out)]) == 0
    assert "robot motion (mjx-hand/robot-motion/1)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"--robot": "robonaut"}, "robot is 'robonaut'; valid: ability,"),
        ({"--urdf": "absent.urdf"}, "absent.urdf: no such file"),
        ({"--robot": "allegro"}, "has no link 'wrist'"),
        ({"recording": "absent.npz"}, "absent.npz: no such file"),
        ({"--urdf": "cut.urdf"}, "cut.urdf: not a URDF that can be read (unclosed token"),
        ({"--out": "o.txt"}, "name it o.npz"),
    ],
)
def test_bad_input_ends_in_one_line_and_status_2(changes, message, recordings, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    whole = urdf_of("inspire").read_text()
    Path("cut.urdf").write_text(whole[: len(whole) // 2])
    options = {"--urdf": str(urdf_of("inspire")), "--robot": "inspire", "--out": str(tmp_path / "o.npz")}
    recording = changes.get("recording", str(recordings / "mediapipe_video/joints.npz"))
    options |= {name: value for name, value in changes.items() if name.startswith("--")}
    assert main(["robot", recording, *(word for pair in options.items() for word in pair)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "o.npz").exists()
