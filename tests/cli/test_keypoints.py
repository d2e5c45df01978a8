"""`mjx-hand keypoints`: from a keypoint file to a motion, with a report; nothing is written of what cannot be used."""

import numpy as np
import pytest

from mjx_hand.cli.main import main
from mjx_hand.motion import load_motion_file
from tests.capture.keypoints.grips import FPS, grip, keypoints_of


def test_made_keypoints_become_a_motion(tmp_path, capsys):
    path, out = tmp_path / "hand.npz", tmp_path / "motion.npz"
    np.savez(path, joints=1000 * keypoints_of(grip("left")))
    assert main(["keypoints", str(path), "--out", str(out), "--fps", str(FPS), "--unit", "mm", "--cutoff", "6"]) == 0
    text = capsys.readouterr().out
    assert "a left hand (as its fingers bend), 60 frames at 50/s" in text
    assert "0 frames in gaps" in text
    assert f"mjx-hand retarget {out} --out angles.npz" in text
    motion = load_motion_file(out)
    assert motion.side == "left"
    assert motion.fps == FPS


def test_own_bones_are_kept(tmp_path):
    np.savez(tmp_path / "hand.npz", joints=keypoints_of(grip()), fps=FPS)
    out = tmp_path / "motion.npz"
    assert main(["keypoints", str(tmp_path / "hand.npz"), "--out", str(out), "--own-bones"]) == 0
    assert load_motion_file(out).link_offset is not None


def test_real_recording(recordings, tmp_path, capsys):
    path = recordings / "leap_motion" / "confidence-37fps.npz"
    assert main(["keypoints", str(path), "--sequence", "right_31", "--out", str(tmp_path / "m.npz")]) == 0
    assert "layout leap, a right hand (as recorded), 393 frames" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("scale", "options", "says"),
    [
        (1000.0, ["--fps", "50"], "about 1000 times too big"),
        (1.0, [], "does not say its frame rate; give fps, as in --fps 30"),
        (1.0, ["--fps", "50", "--side", "left"], "its fingers bend as a right hand's"),
        (1.0, ["--fps", "50", "--cutoff", "40"], "cut-off is 40.0 Hz"),
        (1.0, ["--fps", "50", "--sequence", "thumb"], "has no hand 'thumb'"),
    ],
)
def test_what_cannot_be_used_leaves_no_file(tmp_path, capsys, scale, options, says):
    path, out = tmp_path / "hand.npz", tmp_path / "motion.npz"
    np.savez(path, joints=scale * keypoints_of(grip()))
    assert main(["keypoints", str(path), "--out", str(out), *options]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1
    assert not out.exists()
