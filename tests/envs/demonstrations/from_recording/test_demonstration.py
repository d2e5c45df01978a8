"""A real recording as demonstrations: what must be true of them physically, whatever was captured."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations.contacts import demonstration_gaps
from envs.demonstrations.from_recording.demonstration import read_demonstration
from envs.demonstrations.from_recording.grasp_pose import last_phalanges
from envs.demonstrations.from_recording.support_plane import estimate_support_plane, world_from_recording
from envs.demonstrations.from_recording.variations import RecordingSettings, vary
from envs.demonstrations.set_settings import SetSettings, set_folder
from envs.demonstrations.twin_hands import twins
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.capture.object_poses.dexmv_object import recording_files
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.motion.make_scene import recorded_object
from mjx_hand.motion.scene import RecordedObject
from mjx_hand.objects.description import ObjectDescription
from tests.envs.demonstrations.from_recording.unaided import unaided

FOLDER = Path(__file__).resolve().parents[5] / "shared/data/dexmv_mustard"
CUBE = np.array([[x, y, z] for x in (-0.03, 0.03) for y in (-0.03, 0.03) for z in (-0.05, 0.05)])


def lifted_cube(seed: int, turn: Rotation, frames: int = 80, lift: int = 50) -> RecordedObject:
    """A box that spins as it stands on a tilted table and is lifted, seen with noise."""
    rng = np.random.default_rng(seed)
    height = 0.05 + np.maximum(np.arange(frames) - lift, 0) * 0.01
    spin = Rotation.from_rotvec(rng.uniform(-np.pi, np.pi, (frames, 1)) * [0.0, 0.0, 1.0])
    noise = Rotation.from_rotvec(rng.normal(scale=0.03, size=(frames, 3)))
    world = np.stack([np.zeros(frames), np.zeros(frames), height], axis=1) + rng.normal(scale=0.002, size=(frames, 3))
    turned = (turn * noise * spin).as_quat(scalar_first=True)
    poses = np.concatenate([turn.apply(world) + np.array([0.3, -0.2, 0.9]), turned], axis=1)
    return recorded_object("cube", poses, mesh=(CUBE, np.array([[0, 1, 2]])))


@pytest.mark.parametrize("seed", range(3))
def test_up_is_found_in_a_tilted_recording(seed):
    turn = Rotation.random(rng=np.random.default_rng(seed))
    table = estimate_support_plane(lifted_cube(seed, turn))
    assert np.arccos(table.up @ turn.apply([0, 0, 1])) < np.deg2rad(1.5)
    assert abs(table.height - np.array([0.3, -0.2, 0.9]) @ table.up) < 0.006
    assert 50 <= table.lifted <= 56
    world = world_from_recording(table)
    np.testing.assert_allclose(world @ table.up, [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(world @ world.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(world) > 0


def test_an_object_that_is_never_lifted_is_refused():
    still = lifted_cube(0, Rotation.identity(), lift=200)
    with pytest.raises(InputError, match="stands still in"):
        estimate_support_plane(still)


def reach(frames: int = 150) -> Demonstration:
    wrist = np.stack([np.linspace(-0.3, -0.1, frames), np.zeros(frames), np.full(frames, 0.1)], axis=1)
    wrist[frames // 2 :] = wrist[frames // 2]
    return Demonstration(
        motion=JointMotion(
            fps=50.0,
            angles=np.zeros((frames, 20)),
            wrist_position=wrist,
            wrist_quaternion=np.tile([1.0, 0, 0, 0], (frames, 1)),
            valid=np.ones(frames, bool),
        ),
        object_pose=np.tile([0.0, 0, 0.05, 1, 0, 0, 0], (frames, 1)),
        object=ObjectDescription(kind="box", size=np.array([0.03, 0.03, 0.05]), mass=0.6, friction=0.8),
        support=np.zeros((0, 3)),
        support_position=np.zeros((0, 3)),
        shape=np.zeros(10),
        grasp="recorded",
    )


def test_variations_draw_what_is_said_and_no_more():
    settings, rng = RecordingSettings(path="x"), np.random.default_rng(0)
    made = [vary(reach(), settings, rng) for _ in range(24)]
    masses, frictions = [d.object.mass for d in made], [d.object.friction for d in made]
    assert 0.3 <= min(masses) < 0.4 < 0.55 < max(masses) <= 0.65
    assert 0.7 <= min(frictions) < max(frictions) <= 1.0
    lengths = [d.num_frames for d in made]
    assert 149 / 1.1 - 1 <= min(lengths) < 145 < 155 < max(lengths) <= 149 / 0.9 + 2
    for d in made:
        assert d.motion.angles.shape[0] == d.object_pose.shape[0] == len(d.motion.valid)
        np.testing.assert_allclose(np.linalg.norm(d.motion.wrist_quaternion, axis=1), 1, atol=1e-9)
    spread = np.concatenate([d.motion.angles for d in made]).std()
    assert 0.5 * settings.angle_error < spread < 1.5 * settings.angle_error
    quiet = dataclasses.replace(settings, wrist_error=0.0, angle_error=0.0, start_error=0.0, speeds=(1.0, 1.0))
    same = vary(reach(), quiet, rng)
    np.testing.assert_allclose(same.motion.wrist_position, reach().motion.wrist_position, atol=1e-9)
    np.testing.assert_allclose(same.object_pose, reach().object_pose, atol=1e-9)


def test_what_is_missing_is_said_in_one_line(tmp_path):
    with pytest.raises(InputError, match="no such folder; give the folder of a DexMV recording") as caught:
        recording_files(tmp_path / "none")
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match=r"holds 0 \.npz files"):
        recording_files(tmp_path)
    settings = SetSettings("recorded", recording=RecordingSettings(path=str(tmp_path / "none")))
    with pytest.raises(InputError, match=r"data\.recording\.path=FOLDER"):
        set_folder(settings, tmp_path)
    with pytest.raises(InputError, match=r"give both, data\.grasp=recorded"):
        SetSettings("recorded")
    with pytest.raises(InputError, match=r"data\.recording\.masses"):
        RecordingSettings(masses=(0.5, 0.3))


def test_the_real_bottle_stands_and_is_lifted():
    if not FOLDER.is_dir():
        pytest.skip(f"{FOLDER} is absent: the recording is not part of the project")
    (recorded,) = load_scene(recording_files(FOLDER)[0]).objects
    table = estimate_support_plane(recorded)
    assert 70 <= table.lifted <= 80
    corners = np.einsum("tij,vj->tvi", recorded.rotation, recorded.vertices[::50]) + recorded.position[:, None]
    lowest = (corners @ table.up).min(axis=1) - table.height
    assert np.abs(np.median(lowest[: table.standing])) < 0.005
    assert lowest[table.lifted :].min() > -0.005
    assert 0.1 < lowest.max() < 0.2


@pytest.mark.slow
def test_the_real_recording_becomes_a_demonstration_that_the_engine_carries():
    """With the force that its grasp was found with, from the first frame; with a quarter of it, it is not."""
    if not FOLDER.is_dir():
        pytest.skip(f"{FOLDER} is absent: the recording is not part of the project")
    settings = RecordingSettings(path=str(FOLDER), mass=0.603)
    demonstration = read_demonstration(settings)
    (hand,) = twins([demonstration])
    gaps, height = demonstration_gaps(demonstration, hand), demonstration.object_pose[:, 2]
    assert gaps.min() > -0.006
    assert np.abs(gaps[height > height[0] + 0.02][:, last_phalanges(hand)]).mean() < 0.004

    def error(force: float) -> float:
        poses = unaided(demonstration, hand, force)
        return float(np.linalg.norm(poses[:, :3] - demonstration.object_pose[:, :3], axis=1).mean())

    assert error(settings.force) < 0.01
    assert error(8.0) > 0.05
