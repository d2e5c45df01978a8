"""Captures that are written in other layouts, read back by their importers: the same hand and the same object."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.demonstration import Demonstration, save_demonstration
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.motion.motion import save_motion
from mjx_hand.objects.description import ObjectDescription
from tests.capture.grasps import grasp
from tools.captures_as_recordings import LAYOUTS, main

FRAMES = 40
SIZE = np.array([0.02, 0.03, 0.04])


def capture(side: str):
    motion = grasp(load_hand(side=side), 1, frames=FRAMES)
    turn = Rotation.from_rotvec(np.random.default_rng(2).normal(size=(FRAMES, 3))).as_quat(scalar_first=True)
    place = np.random.default_rng(3).normal(size=(FRAMES, 3))
    demonstration = Demonstration(
        motion=JointMotion(
            fps=motion.fps,
            angles=np.zeros((FRAMES, 20)),
            wrist_position=motion.wrist_position,
            wrist_quaternion=motion.wrist_quaternion,
            valid=motion.valid,
            side=side,
        ),
        object_pose=np.concatenate([place, turn], axis=1),
        object=ObjectDescription(kind="box", size=SIZE, mass=0.2, friction=0.8),
        support=np.zeros((0, 3)),
        support_position=np.zeros((0, 3)),
        shape=np.zeros(10),
        grasp="pinch",
    )
    return motion, demonstration


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("side", ["right", "left"])
def test_what_is_written_is_read_back(layout, side, tmp_path):
    motion, demonstration = capture(side)
    scene = load_scene(LAYOUTS[layout]("000", motion, demonstration, tmp_path))
    (hand,), (cube,) = scene.hands, scene.objects
    assert (hand.side, scene.fps) == (side, motion.fps)
    np.testing.assert_allclose(hand.rotations, motion.rotations, atol=1e-6)
    np.testing.assert_allclose(hand.wrist_position, motion.wrist_position, atol=1e-6)
    between = Rotation.from_quat(hand.wrist_quaternion, scalar_first=True).inv() * Rotation.from_quat(
        motion.wrist_quaternion, scalar_first=True
    )
    assert between.magnitude().max() < 1e-6
    truth = Rotation.from_quat(demonstration.object_pose[:, 3:], scalar_first=True).as_matrix()
    np.testing.assert_allclose(cube.rotation, truth, atol=1e-6)
    np.testing.assert_allclose(cube.position, demonstration.object_pose[:, :3], atol=1e-6)
    assert cube.kind == "mesh"
    np.testing.assert_allclose(np.abs(cube.vertices), np.tile(SIZE, (8, 1)), atol=1e-6)
    np.testing.assert_array_equal(scene.up, [0, 0, 1])


def test_a_whole_set_is_written_and_what_is_none_is_refused(tmp_path, capsys):
    motion, demonstration = capture("right")
    part = tmp_path / "set" / "train"
    part.mkdir(parents=True)
    save_demonstration(demonstration, part / "000.npz")
    with pytest.raises(InputError, match=r"000\.motion\.npz: absent; give a set of a scripted grasp type"):
        main([str(part.parent), str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()
    save_motion(motion, part / "000.motion.npz")
    main([str(part.parent), str(tmp_path / "out"), "grab"])
    assert "1 recordings, grab" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="usage: "):
        main([str(part.parent)])
