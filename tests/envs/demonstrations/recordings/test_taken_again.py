"""An object that is taken, put elsewhere, and taken again: a capture forwards, backwards beside it, and forwards."""

import dataclasses

import numpy as np
import pytest

from envs.demonstrations.from_recording.carry_trial import carry_trial
from envs.demonstrations.load_set import load_part
from envs.demonstrations.observation.handling import CARRIED
from envs.demonstrations.observation.stillness import spans
from envs.demonstrations.recordings.recorded_demonstration import read_recording
from envs.demonstrations.recordings.recording_settings import RecordingSettings
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.make_scene import make_scene, recorded_object
from mjx_hand.motion.motion import Motion, load_motion_file
from mjx_hand.motion.scene import RecordedScene
from mjx_hand.motion.scene_file import save_scene
from mjx_hand.pytree import replace
from mjx_hand.retarget.hands import KinematicHands
from tests.envs.demonstrations.observation.acts import BOX, FACES, HALF, smooth

BESIDE = np.array([0.12, 0.08, 0.0])
CARRY, PAUSE = 50, 25  # frames to beside, and before it is taken again


def twice(motion: Motion, demonstration: Demonstration) -> tuple[RecordedScene, np.ndarray]:
    """The scene, and the object's truth: where the demonstration has it."""
    count = motion.num_frames
    forwards = np.arange(count)
    frames = np.concatenate([forwards, np.full(CARRY, count - 1), forwards[::-1], np.zeros(PAUSE, int), forwards])
    beside = smooth(np.arange(len(frames)) * 1.0, count, count + CARRY)[:, None] * BESIDE
    hand = replace(
        motion,
        rotations=motion.rotations[frames],
        wrist_position=motion.wrist_position[frames] + beside,
        wrist_quaternion=motion.wrist_quaternion[frames],
        valid=motion.valid[frames],
    )
    pose = demonstration.object_pose[frames].copy()
    pose[:, :3] += beside
    cube = recorded_object("cube", pose, mesh=(BOX / HALF * demonstration.object.size, FACES))
    return make_scene(hand, cube, up="+z", source="taken twice"), pose


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1])
def test_the_twin_carries_it_both_times(set_path, tmp_path, number):
    d = load_part(set_path, "train")[number]
    scene, truth = twice(load_motion_file(set_path / "train" / f"{number:03d}.motion.npz"), d)
    save_scene(scene, tmp_path / "twice.npz")
    settings = RecordingSettings(path=str(tmp_path / "twice.npz"), mass=d.object.mass)
    recorded = read_recording(tmp_path / "twice.npz", settings, KinematicHands())
    act, made = recorded.handled.act, recorded.demonstration
    carried = spans(act.labels == CARRIED)
    assert len(carried) == 2
    assert not act.left_out
    assert recorded.figures.supports == [0.0]
    assert recorded.figures.depth < 0.002
    assert recorded.figures.hand_moved < 0.006
    moved = made.object_pose[-1, :2] - made.object_pose[0, :2]
    np.testing.assert_allclose(moved, truth[-1, :2] - truth[act.begin, :2], atol=0.002)
    again = made.object_pose[round(np.mean([carried[0][1], carried[1][0]])), :3]
    np.testing.assert_allclose(again, made.object_pose[0, :3] + BESIDE, atol=0.002)
    shares, _ = carry_trial([made], [recorded.observed.hand])
    print(dataclasses.asdict(recorded.figures), shares)
    assert shares[0] >= 0.9
