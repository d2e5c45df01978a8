"""`load_scene`: both hands and objects of what has them, one hand of everything else."""

import numpy as np
import pytest

from mjx_hand.capture.load import load_motion
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from mjx_hand.motion import save_motion, save_scene
from tests.motion.motions import assert_same
from tests.motion.scenes import scene, still_hand


@pytest.mark.parametrize("suffix", ["npz", "json"])
def test_own_scenes_are_read_as_scenes_and_as_motions(tmp_path, suffix):
    path = tmp_path / f"scene.{suffix}"
    save_scene(scene(), path)
    read = load_scene(path)
    assert [found.name for found in read.objects] == ["box", "wedge"]
    assert [hand.side for hand in read.hands] == ["right", "left"]
    assert [hand.side for hand in load_scene(path, side="left").hands] == ["left"]
    assert_same(load_motion(path, side="left"), scene().hand("left"))
    with pytest.raises(InputError, match="holds both hands; choose one"):
        load_motion(path)
    with pytest.raises(InputError, match="holds one recording; leave out sequence='a'"):
        load_scene(path, sequence="a")
    with pytest.raises(InputError, match="recorded at 30 frames per second"):
        load_scene(path, fps=60)


def test_a_motion_is_a_scene_of_one_hand(tmp_path):
    save_motion(still_hand("left"), tmp_path / "motion.npz")
    read = load_scene(tmp_path / "motion.npz")
    assert (len(read.hands), read.objects, read.up) == (1, (), None)
    assert_same(read.hands[0], still_hand("left"))
    with pytest.raises(InputError, match="no such file"):
        load_scene(tmp_path / "none.npz")
    with pytest.raises(InputError, match="side is 'both'"):
        load_scene(tmp_path / "motion.npz", side="both")


def test_the_real_bottle_is_where_the_cameras_saw_it(recordings):
    """Against the file's own numbers: camera from object is inv(object camera from hand camera) times the pose."""
    folder = recordings / "dexmv_mustard"
    read = load_scene(folder / "sequence.npz")
    (bottle,) = read.objects
    assert (bottle.name, bottle.kind, read.fps, read.num_frames) == ("mustard_bottle", "mesh", 25.0, 122)
    with np.load(folder / "sequence.npz") as file:
        to_camera, poses = file["hand_cam_to_object_cam"], file["object_pose_objcam"][:122]
    corners = np.concatenate([bottle.vertices[::500], np.ones((len(bottle.vertices[::500]), 1))], axis=1)
    expected = np.einsum("ij,tjk,vk->tvi", np.linalg.inv(to_camera)[:3, :3], poses, corners)
    expected += np.linalg.inv(to_camera)[:3, 3]
    found = np.einsum("tij,vj->tvi", bottle.rotation, bottle.vertices[::500]) + bottle.position[:, None]
    assert np.linalg.norm(found - expected, axis=-1).max() < 1.5e-3  # the file's matrices are 0.7 % off rotations
    np.testing.assert_allclose(found.mean(axis=1), expected.mean(axis=1), atol=5e-4)
    assert_same(read.hands[0], load_motion(folder / "sequence.npz"))
