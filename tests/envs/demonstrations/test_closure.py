"""Force closure of contacts whose answer is known: two fingers close where each lies in the other's friction cone."""

import numpy as np
import pytest

from envs.demonstrations.on_robot.closure import closes

LEFT, RIGHT = np.array([-0.02, 0.0, 0.0]), np.array([0.02, 0.0, 0.0])
X, Y = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])


@pytest.mark.parametrize(
    ("up", "friction", "closed"),
    [(0.0, 0.8, True), (0.02, 0.8, True), (0.04, 0.8, False), (0.02, 0.4, False)],  # tan of the angle: up / 0.04
)
def test_two_fingers_close_within_their_cones(up, friction, closed):
    points = np.stack([LEFT, RIGHT + np.array([0, 0, up])]) + np.array([0.3, -0.2, 0.1])
    assert closes(points, np.stack([X, -X]), friction) is closed


def test_what_presses_from_one_side_or_alone_does_not_close():
    assert not closes(np.stack([LEFT, LEFT + 0.01 * Y]), np.stack([X, X]), 0.9)
    assert not closes(LEFT[None], X[None], 0.9)
    assert not closes(np.zeros((0, 3)), np.zeros((0, 3)), 0.9)


def test_three_fingers_close_a_ball_at_little_friction():
    angles = np.deg2rad([90, 210, 330])
    out = np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    assert closes(0.03 * out, -out, 0.2)
    assert not closes(0.03 * out[:2], -out[:2], 0.2)
