"""The wrist's path goes to an object that stands elsewhere and comes back, in the twin and in the player alike."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.disturbances import Randomize
from envs.evaluation.roll_out import make_roll_out, zero_residual
from envs.task import Task
from envs.tracking import TrackingEnv

MOVED = Randomize.only(move=(0.04, 0.04), turn_deg=(15.0, 15.0))


def wrist_in_object(rollouts, frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The palm's first joints, and the hand's first direction, seen from where the object stood at first."""
    rows = np.arange(len(frame))
    turn = Rotation.from_quat(rollouts.object_pose[:, 0, 3:], scalar_first=True).inv()
    joints = rollouts.joints[rows, frame]
    place = turn.apply(joints[:, 0] - rollouts.object_pose[:, 0, :3])
    along = turn.apply(joints[:, 4] - joints[:, 0])
    return place, along


@pytest.fixture(scope="module")
def rolled(demonstrations, hands):
    def roll(randomize: Randomize, follow: bool):
        env = TrackingEnv(demonstrations, hands, "native", Task(follow_object=follow), randomize=randomize)
        return make_roll_out(env, zero_residual)(None)

    return roll


def test_the_hand_is_where_the_object_is_until_it_is_held_and_where_it_was_recorded_at_the_end(env, rolled):
    usual, moved, stays = rolled(Randomize.only(), True), rolled(MOVED, True), rolled(MOVED, False)
    pose, length = np.asarray(env.reference.object_pose), np.asarray(env.reference.length)
    held = np.argmax(np.linalg.norm(pose[..., :3] - pose[:, :1, :3], axis=-1) > 0.01, axis=1)
    before = held - 2
    (place, along), (place_moved, along_moved), (place_stays, _) = (
        wrist_in_object(each, before) for each in (usual, moved, stays)
    )
    assert np.linalg.norm(place_moved - place, axis=1).max() < 0.003
    assert np.linalg.norm(along_moved - along, axis=1).max() < 0.003
    assert np.linalg.norm(place_stays - place, axis=1).min() > 0.03
    rows = np.arange(len(length))
    ends = [each.joints[rows, length - 1, 0] for each in (usual, moved)]
    assert np.linalg.norm(ends[0] - ends[1], axis=1).max() < 0.003


def test_a_shift_that_is_seen_and_not_there_moves_the_hand_as_far(rolled):
    seen = dataclasses.replace(Randomize.only(), seen_move=(0.02, 0.02))
    usual, off = rolled(Randomize.only(), True), rolled(seen, True)
    frame = np.full(len(usual.joints), 30)
    rows = np.arange(len(frame))
    apart = usual.joints[rows, frame, 0] - off.joints[rows, frame, 0]
    assert (np.linalg.norm(apart, axis=1) < 0.021).all(), "what is seen higher or lower is not followed"
    assert (np.linalg.norm(apart[:, :2], axis=1) > 0.003).all()
    assert np.abs(apart[:, 2]).max() < 0.002
