"""Hands stay themselves whatever a tracker's lists and labels say."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from mjx_hand.errors import InputError
from tests.capture.keypoints.grips import grip, keypoints_of

FRAMES = 60
RIGHT = keypoints_of(grip())
LEFT = keypoints_of(grip("left")) + np.array([0.0, 0.3, 0.0])


def written(tmp_path: Path, frames: list) -> Path:
    path = tmp_path / "in.json"
    path.write_text(json.dumps({"fps": 30, "frames": frames}))
    return path


def result(hands: list[tuple[np.ndarray, str]]) -> dict:
    """MediaPipe's result: each hand with its label."""
    return {
        "worldLandmarks": [points.tolist() for points, _ in hands],
        "handedness": [[{"categoryName": label, "score": 0.9}] for _, label in hands],
    }


@pytest.mark.parametrize("swapped", [lambda k: False, lambda k: k >= 40, lambda k: 20 <= k < 26, lambda k: k % 2 == 1])
def test_unlabelled_hands_in_any_order(tmp_path, swapped):
    frames = [
        {"hands": [h.tolist() for h in ((LEFT[k], RIGHT[k]) if swapped(k) else (RIGHT[k], LEFT[k]))]}
        for k in range(FRAMES)
    ]
    path = written(tmp_path, frames)
    np.testing.assert_allclose(load_keypoints(path, side="right").positions, RIGHT)
    np.testing.assert_allclose(load_keypoints(path, side="left").positions, LEFT)


def test_a_label_that_flips_is_one_hand(tmp_path):
    frames = [result([(RIGHT[k], "Left" if k % 7 else "Right")]) for k in range(FRAMES)]
    np.testing.assert_allclose(load_keypoints(written(tmp_path, frames)).positions, RIGHT)


def test_two_hands_under_one_label_in_some_frames(tmp_path):
    frames = [result([(RIGHT[k], "Left"), (LEFT[k], "Left" if 10 <= k < 20 else "Right")]) for k in range(FRAMES)]
    path = written(tmp_path, frames)
    np.testing.assert_allclose(load_keypoints(path, side="right").positions, RIGHT)
    np.testing.assert_allclose(load_keypoints(path, side="left").positions, LEFT)


@pytest.mark.parametrize("first", [True, False])
def test_a_false_second_detection_is_left_out_and_told(tmp_path, first):
    frames = [[RIGHT[k].tolist()] for k in range(FRAMES)]
    ghost = (RIGHT[21] + np.array([0.4, 0, 0])).tolist()
    frames[20] = [ghost, RIGHT[20].tolist()] if first else [RIGHT[20].tolist(), ghost]
    found = load_keypoints(written(tmp_path, [{"hands": hands} for hands in frames]))
    np.testing.assert_allclose(found.positions, RIGHT)
    (warning,) = found.warnings
    assert "left out what is seen in few frames" in warning
    assert "in 1 of 60" in warning


def test_a_false_second_hand_of_a_side_that_is_said(tmp_path):
    frames = [{"hands": [{"side": "right", "joints": RIGHT[k].tolist()}]} for k in range(FRAMES)]
    frames[20]["hands"].append({"side": "right", "joints": (RIGHT[20] + np.array([0.4, 0, 0])).tolist()})
    found = load_keypoints(written(tmp_path, frames), side="right")
    np.testing.assert_allclose(found.positions, RIGHT)
    assert found.warnings


def test_hands_of_two_people_are_told_apart_by_place(tmp_path):
    far = RIGHT + np.array([0.0, 0.0, 1.0])
    frames = [{"hands": [h.tolist() for h in ((far[k], RIGHT[k]) if k % 3 else (RIGHT[k], far[k]))]} for k in range(60)]
    path = written(tmp_path, frames)
    with pytest.raises(InputError, match="holds 2 right hands"):
        load_keypoints(path, side="right")
    names = ("0", "1")
    found = [load_keypoints(path, sequence=name).positions for name in names]
    assert any(np.allclose(each, RIGHT) for each in found)
    assert any(np.allclose(each, far) for each in found)


def test_a_hand_with_other_points_in_one_frame_is_left_out(tmp_path):
    frames = [points.tolist() for points in RIGHT]
    frames[7] = frames[7][:20]
    found = load_keypoints(written(tmp_path, frames))
    assert np.isnan(found.positions[7]).all()
    np.testing.assert_allclose(np.delete(found.positions, 7, axis=0), np.delete(RIGHT, 7, axis=0))
    assert "1 hands left out that have other points than most, first in frame 7" in found.warnings


def leap(k: int, hands: list[tuple[int, str, np.ndarray]]) -> dict:
    """A frame of Leap's recorder, of hands by id."""
    row: dict = {"timestamp": round(k * 1e6 / 30), "hands": [], "pointables": []}
    for number, side, points in hands:
        p = 1e3 * points
        row["hands"].append({"id": number, "type": side, "wrist": p[0].tolist()})
        for finger, base in enumerate((1, 5, 9, 13, 17)):
            joints = {f"{j}Position": p[base + i].tolist() for i, j in enumerate(("mcp", "pip", "dip", "btip"))}
            row["pointables"].append({"id": 10 * number + finger, "handId": number, "type": finger, **joints})
    return row


def test_a_hand_found_again_under_a_new_id(tmp_path):
    lost = range(30, 35)
    frames = [
        leap(k, [(3, "left", LEFT[k])] + ([] if k in lost else [(7 if k < 30 else 12, "right", RIGHT[k])]))
        for k in range(FRAMES)
    ]
    path = tmp_path / "in.json"
    path.write_text(json.dumps(frames))
    expected = RIGHT.copy()
    expected[lost] = np.nan
    choices: list[dict[str, Any]] = [{"side": "right"}, {"sequence": "right_7+right_12"}]
    for options in choices:
        found = load_keypoints(path, **options)
        np.testing.assert_allclose(found.positions, expected, atol=1e-9)
        assert found.warnings == ("right_7 was lost and found again as right_12; they are taken as one",)
    assert not load_keypoints(path, side="left").warnings
    part = load_keypoints(path, sequence="right_12")
    assert not part.warnings
    assert np.isfinite(part.positions).all(axis=(1, 2)).sum() == FRAMES - 35
