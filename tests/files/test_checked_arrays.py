"""Recordings without frames are refused wherever their arrays are read."""

import numpy as np
import pytest

from envs.demonstrations.scripted.simulated_capture import Truth, load_truth, save_truth
from mjx_hand.errors import InputError
from mjx_hand.robots.robot_motion import RobotMotion, load_robot_motion, save_robot_motion


def test_no_frames_of_a_robot(tmp_path):
    motion = RobotMotion(
        fps=30.0,
        values=np.zeros((0, 2)),
        base_position=np.zeros((0, 3)),
        base_quaternion=np.zeros((0, 4)),
        valid=np.zeros(0, bool),
        joint_names=("a", "b"),
    )
    save_robot_motion(motion, tmp_path / "a.npz")
    with pytest.raises(InputError, match=r"no frames \(angles has shape \(0, 2\)\); save at least one"):
        load_robot_motion(tmp_path / "a.npz")


def test_no_frames_of_a_truth(tmp_path):
    truth = Truth(np.zeros((0, 20)), np.zeros((0, 3)), np.zeros((0, 4)), np.zeros((0, 7)), np.zeros(10))
    save_truth(truth, tmp_path / "a.npz")
    with pytest.raises(InputError, match="no frames"):
        load_truth(tmp_path / "a.npz")
