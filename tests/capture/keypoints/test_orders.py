"""21 points without names are read in the order in which they are a hand."""

import numpy as np
import pytest

from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from mjx_hand.capture.keypoints.layouts import LAYOUTS, from_keypoints
from mjx_hand.capture.keypoints.orders import order_of
from tests.capture.keypoints.grips import FPS, grip, keypoints_of

# MANO's joints (wrist; index, middle, little, ring, thumb, three each) among the 21 keypoints, then tips in two orders.
JOINTS = [0, 5, 6, 7, 9, 10, 11, 17, 18, 19, 13, 14, 15, 1, 2, 3]
ORDERS = {
    "mediapipe": list(range(21)),
    "mano": [*JOINTS, 4, 8, 12, 16, 20],  # SMPL-X's and manopth's
    "mano_index_first": [*JOINTS, 8, 12, 20, 16, 4],
}


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("side", ["right", "left"])
def test_order_is_told_by_the_bones(tmp_path, order, side):
    points = keypoints_of(grip(side))
    np.testing.assert_allclose(from_keypoints(points, LAYOUTS[order]), points[:, ORDERS[order]])
    for some in (points, points[7:8], 1000 * points, points + np.random.default_rng(0).normal(0, 0.004, points.shape)):
        assert order_of(some[:, ORDERS[order]]).name == order
    np.savez(tmp_path / "in.npz", joints=points[:, ORDERS[order]], fps=FPS)
    found = load_keypoints(tmp_path / "in.npz")
    np.testing.assert_allclose(found.positions, points)
    assert found.layout == order


def test_real_recordings_stay_in_mediapipes_order(recordings):
    with np.load(recordings / "mediapipe_video" / "joints.npz") as file:
        joints = file["joints"]
    assert all(order_of(joints[k : k + 1]).name == "mediapipe" for k in range(0, len(joints), 5))
    with np.load(recordings / "dexmv_mustard" / "sequence.npz") as file:
        names, joints = [str(name) for name in file["joint_order"]], file["joints"]
    assert len(names) == 21
    assert order_of(joints).name == "mediapipe"


def test_nothing_seen_is_no_other_order():
    assert order_of(np.full((3, 21, 3), np.nan)).name == "mediapipe"
    assert order_of(np.zeros((3, 21, 3))).name == "mediapipe"
