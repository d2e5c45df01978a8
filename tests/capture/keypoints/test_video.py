"""A video through MediaPipe, where it is installed; what is said where it is not, or where there is no video."""

import importlib.util

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.capture.keypoints.video import track_video
from mjx_hand.cli.main import main
from mjx_hand.errors import InputError

INSTALLED = importlib.util.find_spec("mediapipe") is not None


@pytest.mark.skipif(INSTALLED, reason="MediaPipe is installed")
def test_the_extra_is_named_where_it_is_missing(tmp_path, capsys):
    (tmp_path / "hand.mp4").write_bytes(b"")
    assert main(["track", str(tmp_path / "hand.mp4"), "--out", str(tmp_path / "hand.npz")]) == 2
    assert "pip install -e '.[video]'" in capsys.readouterr().err


def test_a_missing_video_is_said(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        track_video(tmp_path / "absent.mp4")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning", "ignore::DeprecationWarning")
def test_the_recorded_video_gives_the_recorded_keypoints(recordings):
    if not INSTALLED:
        pytest.skip("MediaPipe is not installed: pip install -e '.[video]'")
    folder = recordings / "mediapipe_video"
    hands = track_video(folder / "human_hand_video.mp4")
    assert set(hands) == {"right"}
    found, known = hands["right"].positions, np.load(folder / "joints.npz")["joints"]
    assert np.isfinite(found).all()
    for mine, theirs in zip(found[::20], known[::20], strict=True):  # theirs are turned, with the wrist at the origin
        turn = Rotation.align_vectors(theirs, mine - mine[0])[0]
        assert np.linalg.norm(turn.apply(mine - mine[0]) - theirs, axis=1).mean() < 0.002
