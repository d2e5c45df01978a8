"""Left-hand recordings, alone and among right-hand ones: the mirror image of a recording becomes that of its result."""

import numpy as np
import pytest

from envs.demonstrations.load_set import load_part
from envs.demonstrations.observation.scene_in_world import handled_object
from envs.demonstrations.recordings.recorded_demonstration import Figures
from envs.demonstrations.recordings.recorded_set import PLAIN, of_one_hand, recorded_set
from envs.demonstrations.recordings.recording_settings import RecordingSettings
from mjx_hand.motion.make_scene import make_scene, recorded_object
from mjx_hand.motion.mirror import mirrored_demonstration, mirrored_motion, mirrored_pose
from mjx_hand.motion.motion import load_motion_file
from mjx_hand.motion.scene import RecordedScene
from mjx_hand.motion.scene_file import save_scene
from mjx_hand.retarget.hands import KinematicHands
from tests.envs.demonstrations.observation.acts import BOX, FACES, HALF, way
from tests.envs.demonstrations.observation.acts import scene as made_up
from tests.envs.demonstrations.observation.test_handled import TIMES, UP, hand_with
from tests.envs.demonstrations.recordings.test_recordings import reach

MIRROR = np.array([-1.0, 1, 1])


def mirrored(scene: RecordedScene) -> RecordedScene:
    """What a left hand does in a mirror in which x points the other way."""
    objects = [
        recorded_object(
            found.name,
            mirrored_pose(np.concatenate([found.position, found.quaternion], axis=1)),
            mesh=(found.vertices * MIRROR, found.faces[:, ::-1]),
        )
        for found in scene.objects
    ]
    return make_scene([mirrored_motion(hand) for hand in scene.hands], objects, up=scene.up, source="mirrored")


def figures(name: str, side: str) -> Figures:
    lengths = ("gap_before", "gap", "depth_before", "depth", "hand_moved", "hand_turned", "angles_moved")
    lengths += ("object_moved", "object_turned", "way_moved")
    frames = {"first": 0, "last": 99, "frames": 100, "pieces": 1, "bridged": 0}
    said = {"object": "cube", "up": "told", "how_heavy": "given", "supports": [0.0], "touching": [], "left_out": {}}
    return Figures(name=name, side=side, rate=50.0, mass=0.1, **frames, **said, **dict.fromkeys(lengths, 0.0))


def test_those_that_are_fewer_are_mirrored():
    right = reach()
    left = mirrored_demonstration(right)
    many = [figures("a", "right"), figures("b", "left"), figures("c", "left")]
    demonstrations, told = of_one_hand([right, left, left], many)
    assert [d.motion.side for d in demonstrations] == ["left"] * 3
    assert [f.mirrored for f in told] == [True, False, False]
    assert [f.side for f in told] == ["right", "left", "left"]  # of the recording
    np.testing.assert_allclose(demonstrations[0].motion.wrist_position, right.motion.wrist_position * MIRROR)
    assert demonstrations[1] is left
    assert [d.motion.side for d in of_one_hand([right, left], many[:2])[0]] == ["right"] * 2


def test_a_left_hands_act_is_the_mirror_image_of_the_right_ones():
    box = UP + way(TIMES, [(1.5, 2.3, [0.05, 0, 0.12]), (2.3, 3.0, [0.1, 0.2, -0.12])])
    right = made_up(box, [hand_with(box, 1.4, 3.2)])
    one = handled_object(right, "right", KinematicHands())
    other = handled_object(mirrored(right), "left", KinematicHands(), side="left")
    assert (one.motion.side, other.motion.side) == ("right", "left")
    assert (one.act.begin, one.act.end) == (other.act.begin, other.act.end)
    np.testing.assert_array_equal(one.act.labels, other.act.labels)
    np.testing.assert_allclose(one.distance, other.distance, atol=2e-3)  # samples of the surface are others
    np.testing.assert_allclose(other.path.position, one.path.position * MIRROR, atol=1e-9)


@pytest.mark.slow
def test_a_folder_of_both_hands_becomes_one_hands_set_of_mirror_images(set_path, tmp_path):
    """A capture, its mirror image and another mirror image: two of three are left hands', and the first two are one."""
    scenes = []
    for k in (0, 1):
        d = load_part(set_path, "train")[k]
        cube = recorded_object("cube", d.object_pose, mesh=(BOX / HALF * d.object.size, FACES))
        scenes.append(make_scene(load_motion_file(set_path / "train" / f"{k:03d}.motion.npz"), cube, up="+z"))
    for name, scene in zip("abc", (scenes[0], mirrored(scenes[0]), mirrored(scenes[1])), strict=True):
        save_scene(scene, tmp_path / f"{name}.npz")
    found = recorded_set(RecordingSettings(path=str(tmp_path), mass=0.2))
    assert not found.refused
    assert [d.motion.side for d in found.demonstrations] == ["left"] * 3
    assert [(f.side, f.mirrored) for f in found.figures] == [("right", True), ("left", False), ("left", False)]
    assert [f.road for f in found.figures] == [PLAIN] * 3
    first, second, _ = found.demonstrations
    assert first.num_frames == second.num_frames
    np.testing.assert_allclose(first.object_pose, second.object_pose, atol=1e-3)
    np.testing.assert_allclose(first.motion.wrist_position, second.motion.wrist_position, atol=1e-3)
    assert np.abs(first.motion.angles - second.motion.angles).mean() < 0.01
    alone = recorded_set(RecordingSettings(path=str(tmp_path), mass=0.2, side="right"))
    assert [f.name for f in alone.figures] == ["a"]
    assert alone.demonstrations[0].motion.side == "right"
    assert [name for name, _ in alone.refused] == ["b", "c"]
    assert all("left" in why for _, why in alone.refused)
