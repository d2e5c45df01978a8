"""Targets never jump: a lost hand comes to rest, a found one is approached gently, a seen one is followed at once."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.live.twin.follower import FREE, GENTLE, Follower
from envs.live.twin.pose import HandPose, moved, way

TICK = 0.004


def pose(place: tuple[float, float, float] = (0.0, 0.0, 0.2), turn: float = 0.0, bend: float = 0.0) -> HandPose:
    quaternion = Rotation.from_rotvec([0.3 * turn, 0.1 * turn, turn]).as_quat(scalar_first=True)
    return HandPose(np.array(place), quaternion, np.full(20, bend))


def test_a_way_leads_from_one_pose_to_the_other():
    a, b = pose(turn=0.4, bend=0.1), pose((0.1, -0.2, 0.3), 2.9, 0.7)
    there = moved(a, way(a, b))
    np.testing.assert_allclose(there.position, b.position)
    np.testing.assert_allclose(there.angles, b.angles)
    assert abs(there.quaternion @ b.quaternion) == pytest.approx(1.0)


def test_a_hand_that_is_seen_is_where_it_is_seen():
    follower = Follower(pose())
    for k in range(100):  # 1 m/s, 3 rad/s, frames 60 times a second
        wanted = pose((0.0167 * (k + 1), 0.0, 0.2), 0.05 * k, 0.01 * k)
        for _ in range(4):
            follower.advance(wanted, TICK)
        assert np.abs(way(follower.pose, wanted)).max() < 1e-9


def test_a_lost_hand_coasts_to_rest():
    follower = Follower(pose())
    for k in range(250):  # 0.5 m/s
        follower.advance(pose((0.002 * k, 0.0, 0.2)), TICK)
    places = [follower.pose.position[0]] + [follower.advance(None, TICK).position[0] for _ in range(500)]
    steps = np.diff(places)
    assert steps[0] == pytest.approx(0.002, rel=0.1)  # as fast as before at first
    assert (np.diff(steps) <= 1e-12).all()  # and ever slower
    assert abs(steps[-1]) < 1e-6
    assert places[-1] - places[0] < 0.06


@pytest.mark.parametrize("frames_lost", [0, 1, 1000])
def test_a_hand_that_is_elsewhere_is_approached_gently(frames_lost: int):
    follower = Follower(pose())
    for _ in range(frames_lost):
        follower.advance(None, TICK)
    wanted = pose((0.4, -0.3, 0.5), 2.5, 1.2)
    steps = []
    for _ in range(400):
        before = follower.pose
        steps.append(way(before, follower.advance(wanted, TICK)))
    speed = np.array([[np.linalg.norm(s[:3]), np.linalg.norm(s[3:6]), np.abs(s[6:]).max()] for s in steps]) / TICK
    assert (speed[:5] < 1.2 * GENTLE).all()
    assert (speed <= FREE * (1 + 1e-9)).all()
    assert np.abs(way(follower.pose, wanted)).max() < 1e-9
