"""Landmarks of a picture that no form names as such are warned about; metres are not."""

import numpy as np
import pytest

from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from tests.capture.keypoints.grips import FPS, grip, keypoints_of

HAND = keypoints_of(grip())
ABOUT = HAND - HAND.mean(axis=1, keepdims=True)


@pytest.mark.parametrize("width", [16 / 9, 9 / 16, 4 / 3])
@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_shares_of_an_oblong_picture_are_warned_about(tmp_path, width, noise):
    points = ABOUT + np.random.default_rng(0).normal(0, noise, ABOUT.shape)
    np.savez(tmp_path / "in.npz", landmarks=1.6 * points / [width, 1, width] + [0.5, 0.5, 0], fps=FPS, side="right")
    (warning,) = load_keypoints(tmp_path / "in.npz").warnings
    assert "these look like landmarks of the image" in warning


def test_metres_within_a_metre_are_not(tmp_path, recordings):
    np.savez(tmp_path / "in.npz", joints=ABOUT + 0.5, fps=FPS)
    assert not load_keypoints(tmp_path / "in.npz").warnings
    for name in ("mediapipe_video/joints.npz", "leap_motion/grab.npz"):
        found = load_keypoints(recordings / name)
        np.savez(tmp_path / "in.npz", joints=found.positions - np.nanmin(found.positions, axis=(0, 1)), fps=30,
                 layout="mediapipe")  # fmt: skip
        assert not load_keypoints(tmp_path / "in.npz").warnings
