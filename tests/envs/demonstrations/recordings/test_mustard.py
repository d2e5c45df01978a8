"""The real recording (DexMV's bottle), the whole road: what comes out of it, in the engine and beside the recording."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import capsule_gaps
from envs.demonstrations.recordings.recorded_set import SEARCHED, recorded_set
from envs.demonstrations.recordings.recording_settings import RecordingSettings
from envs.grip_force import grip_force_of
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.rigid.build import build_rigid_hand
from tests.envs.demonstrations.from_recording.unaided import unaided

FOLDER = Path(__file__).resolve().parents[5] / "shared/data/dexmv_mustard"
HAND, OBJECT = 0.025, 0.012  # m on average; docs/demonstrations.md says what was measured


@pytest.mark.slow
def test_the_bottle_is_carried_by_a_hand_near_the_recorded_one():
    if not FOLDER.is_dir():
        pytest.skip(f"{FOLDER} is absent: the recording is not part of the project")
    found = recorded_set(RecordingSettings(path=str(FOLDER), mass=0.603))
    (d,), (figures,) = found.demonstrations, found.figures
    assert figures.road == SEARCHED
    hand = build_rigid_hand(load_hand(), d.shape)
    poses = unaided(d, hand, grip_force_of(d.object.mass, d.object.friction, 4.5))
    off = np.linalg.norm(poses[:, :3] - d.object_pose[:, :3], axis=1)
    assert poses[:, 2].max() - poses[0, 2] > 0.1
    assert off.mean() < 0.01
    assert off.max() < 0.035
    turned = Rotation.from_quat(poses[:, 3:], scalar_first=True).inv() * Rotation.from_quat(
        d.object_pose[:, 3:], scalar_first=True
    )
    assert turned.magnitude().max() < 0.6
    assert deepest(d, hand) < 0.002
    assert figures.hand_moved < HAND
    assert away_from_recorded(d, figures.first) < HAND
    assert figures.way_moved < OBJECT


def deepest(d: Demonstration, hand) -> float:
    """How deep (m) a demonstrated hand is in its object, at most."""
    wrist = np.swapaxes(quaternion_matrices(d.motion.wrist_quaternion), 1, 2)
    rotation = wrist @ quaternion_matrices(d.object_pose[:, 3:])
    place = np.einsum("tij,tj->ti", wrist, d.object_pose[:, :3] - d.motion.wrist_position)
    planes = hull_planes(d.object.hulls)
    rows = zip(d.motion.angles[::4], rotation[::4], place[::4], strict=True)
    return -min(float(capsule_gaps(*row, hand, planes).min()) for row in rows)


def away_from_recorded(d: Demonstration, first: int) -> float:
    """Mean distance (m) of the wrist from the file's own, laid over each other as well as a rigid motion can."""
    recorded = load_scene(next(FOLDER.glob("*.npz"))).hands[0]
    frames = first + np.arange(d.num_frames) * recorded.fps / d.motion.fps
    there = np.stack([np.interp(frames, np.arange(len(c)), c) for c in recorded.wrist_position.T], axis=1)
    made = d.motion.wrist_position
    turn = Rotation.align_vectors(made - made.mean(axis=0), there - there.mean(axis=0))[0]
    laid = turn.apply(there - there.mean(axis=0)) + made.mean(axis=0)
    return float(np.linalg.norm(laid - made, axis=1).mean())
