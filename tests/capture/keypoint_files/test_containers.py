"""Keypoints in everyday containers: lone and pickled arrays, long tables, tables with other columns."""

import pickle
from typing import Any

import numpy as np
import pytest

from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.errors import InputError
from tests.capture.keypoints.grips import grip, keypoints_of

HAND = keypoints_of(grip())[:30]
OTHER = keypoints_of(grip("left"))[:30] - np.array([0.3, 0.0, 0.0])
AXES = [f"{name}_{axis}" for name in KEYPOINTS for axis in "xyz"]


def test_lone_and_pickled_arrays(tmp_path):
    np.save(tmp_path / "lone.npy", HAND)
    np.save(tmp_path / "flat.npy", HAND.reshape(30, 63))
    (tmp_path / "lone.pkl").write_bytes(pickle.dumps(HAND))
    (tmp_path / "lists.pkl").write_bytes(pickle.dumps(HAND.tolist()))
    (tmp_path / "named.pkl").write_bytes(pickle.dumps({"hand_joints": 1000 * HAND, "fps": 30.0, "unit": "MM"}))
    named: Any = {"keypoints": HAND, "side": "Right"}
    np.save(tmp_path / "named.npy", named)
    np.savez(tmp_path / "capitals.npz", right_joints=HAND, fps=[30.0], unit=np.array(["M"]), side=b"Right")
    np.savez(tmp_path / "capitals.NPZ.npz", joints=HAND)
    (tmp_path / "capitals.NPZ.npz").rename(tmp_path / "capitals.NPZ")
    for path in sorted(tmp_path.iterdir()):
        found = load_keypoints(path, fps=30.0)
        np.testing.assert_allclose(found.positions, HAND, err_msg=path.name)
    assert load_keypoints(tmp_path / "named.npy").side == "right"
    assert load_keypoints(tmp_path / "capitals.npz").side == "right"
    np.save(tmp_path / "one.npy", HAND[4])
    np.testing.assert_allclose(load_keypoints(tmp_path / "one.npy").positions, HAND[4:5])


def test_a_refusal_says_what_is_there(tmp_path):
    def refused(name: str) -> str:
        with pytest.raises(InputError) as caught:
            load_keypoints(tmp_path / name)
        assert len(str(caught.value)) < 600
        return str(caught.value)

    np.save(tmp_path / "turned.npy", HAND.transpose(0, 2, 1))
    assert "an array (30, 3, 21) of float64 without names; keypoints are 21 points" in refused("turned.npy")
    nested: Any = {"world_coord": {"joints.right": HAND}, "params": {"rot_r": np.zeros((30, 3))}}
    np.save(tmp_path / "nested.npy", nested)
    assert "world_coord (joints.right (30, 21, 3)), params (rot_r (30, 3))" in refused("nested.npy")
    np.savez(tmp_path / "beside.npz", joints=HAND, box_poses=np.zeros((30, 4, 4)))
    assert "joints (30, 21, 3), box_poses (30, 4, 4)" in refused("beside.npz")
    for name, shape in (("lone", (0, 21, 3)), ("flat", (0, 63))):
        np.save(tmp_path / f"{name}.npy", np.zeros(shape))
        assert "the recording has no frames" in refused(f"{name}.npy")
    (tmp_path / "header.csv").write_text(lines(["t", *AXES], []))
    assert "the recording has no frames" in refused("header.csv")
    (tmp_path / "angles.csv").write_text("time,j_thumb_fle,j_index_fle\n0,1,2\n0.1,1,2\n")
    assert "a table of 2 rows and the columns time, j_thumb_fle, j_index_fle" in refused("angles.csv")


def lines(columns: list[str], rows: list[list], separator: str = ",", point: str = ".") -> str:
    cells = [[str(v).replace(".", point) if isinstance(v, float) else str(v) for v in row] for row in rows]
    return "\n".join([separator.join(columns), *map(separator.join, cells)]) + "\n"


@pytest.mark.parametrize(("separator", "point"), [(",", "."), (";", "."), (";", ","), ("\t", ","), ("\t", ".")])
def test_tables_with_other_columns_and_separators(tmp_path, separator, point):
    beside = {"handedness": "Right", "file": "a/b.png", "score": 0.98, "valid": "true", "date": "2024-05-01T10:00:00"}
    rows = [[*beside.values(), *p.ravel().tolist()] for p in HAND]
    (tmp_path / "in.csv").write_text("# fps: 30\n" + lines([*beside, *AXES], rows, separator, point))
    found = load_keypoints(tmp_path / "in.csv")
    np.testing.assert_allclose(found.positions, HAND)
    assert found.fps == 30


def test_a_line_for_each_hand(tmp_path):
    rows = [[k, side, *p[k].ravel().tolist()] for k in range(30) for side, p in (("left", OTHER), ("right", HAND))]
    (tmp_path / "in.csv").write_text("# fps: 30\n" + lines(["frame", "hand", *AXES], rows))
    np.testing.assert_allclose(load_keypoints(tmp_path / "in.csv", side="right").positions, HAND)
    np.testing.assert_allclose(load_keypoints(tmp_path / "in.csv", side="left").positions, OTHER)


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize("by_hand", [True, False])
def test_a_line_for_each_landmark(tmp_path, named, by_hand):
    lost = {(5, "right"), (9, "left")}
    rows = [
        [k, side, KEYPOINTS[i] if named else i, *p[k, i].tolist()]
        for k in range(30)
        for side, p in (("right", HAND), ("left", OTHER))
        for i in range(21)
        if (k, side) not in lost
    ]
    rows = sorted(rows, key=lambda row: row[1]) if by_hand else rows
    (tmp_path / "in.csv").write_text("# fps: 30\n" + lines(["frame", "hand", "landmark", "x", "y", "z"], rows))
    for side, p in (("right", HAND), ("left", OTHER)):
        expected = p.copy()
        expected[[k for k, which in lost if which == side]] = np.nan
        found = load_keypoints(tmp_path / "in.csv", side=side)
        np.testing.assert_allclose(found.positions, expected)
        assert found.side == side


def test_a_long_table_of_one_hand_with_gaps(tmp_path):
    rows = [[k, i, *HAND[k, i].tolist()] for k in range(30) if k not in (6, 7) for i in range(21) if (k, i) != (3, 8)]
    (tmp_path / "in.csv").write_text("# fps: 30\n" + lines(["frame", "landmark", "x", "y", "z"], rows))
    expected = HAND.copy()
    expected[[6, 7]] = np.nan
    expected[3, 8] = np.nan
    np.testing.assert_allclose(load_keypoints(tmp_path / "in.csv").positions, expected)
    (tmp_path / "in.csv").write_text(lines(["frame", "landmark", "x", "y", "z"], [*rows[:3], rows[0]]))
    with pytest.raises(InputError, match="frame 0 has landmark '0' twice"):
        load_keypoints(tmp_path / "in.csv")


def test_a_table_of_many_columns_takes_no_time(tmp_path):
    (tmp_path / "in.csv").write_text(",".join(f"c{k}" for k in range(60_000)) + "\n")
    with pytest.raises(InputError, match="a table of 0 rows"):
        load_keypoints(tmp_path / "in.csv")
