"""Keypoints at exactly 0, 0, 0, and frames that are null, in every form of file."""

import json

import numpy as np
import pytest

from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from mjx_hand.capture.keypoints.at_origin import without_zeros
from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from tests.capture.keypoints.grips import grip, keypoints_of

POINTS = keypoints_of(grip())[:30]
TIP = KEYPOINTS.index("index_tip")


def written(folder, points):
    """The points as .npz, .json and .csv at 50/s."""
    paths = [folder / f"hand.{suffix}" for suffix in ("npz", "json", "csv")]
    np.savez(paths[0], joints=points, fps=50.0, side="right")
    frames = [{name: p.tolist() for name, p in zip(KEYPOINTS, frame, strict=True)} for frame in points]
    paths[1].write_text(json.dumps({"fps": 50, "side": "right", "frames": frames}))
    head = ",".join(f"{name}_{axis}" for name in KEYPOINTS for axis in "xyz")
    rows = "\n".join(",".join(map(str, frame.ravel().tolist())) for frame in points)
    paths[2].write_text(f"# fps: 50\n# side: right\n{head}\n{rows}\n")
    return paths


def test_a_joint_or_a_hand_at_zero_is_missing(tmp_path):
    zero, missing = POINTS.copy(), POINTS.copy()
    for points, value in ((zero, 0.0), (missing, np.nan)):
        points[5:9, TIP] = value
        points[12:15] = value
    for path in written(tmp_path, zero):
        np.testing.assert_allclose(load_keypoints(path).positions, missing)


@pytest.mark.parametrize("joint", ["wrist", "middle_mcp"])
def test_the_origin_of_a_relative_recording_is_seen(tmp_path, joint):
    relative = POINTS - POINTS[:, [KEYPOINTS.index(joint)]]
    lost = relative.copy()
    lost[12:15] = 0.0  # without a hand
    expected = relative.copy()
    expected[12:15] = np.nan
    for path in written(tmp_path, lost):
        np.testing.assert_allclose(load_keypoints(path).positions, expected)


def test_a_joint_that_is_never_tracked_is_no_origin():
    points = POINTS.copy()
    points[:, TIP] = 0.0
    assert np.isnan(without_zeros(points)[:, TIP]).all()
    relative = POINTS - POINTS[:, :1]
    relative[:, KEYPOINTS.index("middle_mcp")] = 0.0
    found = without_zeros(relative)
    assert np.isfinite(found[:, 0]).all()
    assert np.isnan(found[:, KEYPOINTS.index("middle_mcp")]).all()


def test_nothing_is_interpolated_towards_a_zero(tmp_path):
    times = np.arange(30) / 50 + np.where(np.arange(30) % 3 == 1, 0.006, 0.0)
    zero = POINTS.copy()
    zero[10] = 0.0
    np.savez(tmp_path / "hand.npz", joints=zero, t=times, side="right")
    found = load_keypoints(tmp_path / "hand.npz").positions
    seen = np.isfinite(found).all(axis=(1, 2))
    np.testing.assert_allclose(found[seen], POINTS[: len(found)][seen], atol=0.01)


@pytest.mark.parametrize("null", [None, {}, []])
def test_nulls_between_frames_with_times(tmp_path, null):
    frames = [{"time": k / 50, "joints": p.tolist()} for k, p in enumerate(POINTS)]
    frames[4:7] = [null] * 3
    (tmp_path / "hand.json").write_text(json.dumps(frames))
    found = load_keypoints(tmp_path / "hand.json")
    assert found.fps == pytest.approx(50)
    assert np.flatnonzero(np.isnan(found.positions[:, 0, 0])).tolist() == [4, 5, 6]
