"""A tracker's trembling is taken out of a hand at rest, and a quick hand is not late."""

import numpy as np
import pytest

from envs.live.twin.pose import HandPose, moved, way
from envs.live.twin.steady import Steady

REST = HandPose(np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.5, 0.5, 0.5]), np.full(20, 0.4))


@pytest.mark.parametrize("rate", [30.0, 60.0])
def test_trembling_at_rest_is_less_than_half(rate):
    rng, steady = np.random.default_rng(0), Steady()
    noise = np.array([0.002] * 3 + [0.02] * 3 + [0.05] * 20)
    given = [moved(REST, noise * rng.normal(size=26)) for _ in range(300)]
    shown = [steady.filtered(pose, k / rate) for k, pose in enumerate(given)][30:]
    before, after = (np.std([way(REST, pose) for pose in poses], axis=0) for poses in (given[30:], shown))
    assert (after < 0.5 * before).all()


def test_a_quick_hand_is_hardly_late():
    steady, late = Steady(), []
    speed = np.array([0.8, 0, 0, 0, 0, 2.0, *[4.0] * 20])  # m/s, rad/s, rad/s
    for k in range(60):
        pose = moved(REST, speed * k / 60)
        shown = steady.filtered(pose, k / 60)
        late.append(way(shown, pose) @ speed / (speed @ speed))
    assert max(late[20:]) < 0.05  # s


def test_what_follows_nothing_is_taken_as_it_is():
    steady = Steady()
    far = moved(REST, np.full(26, 0.3))
    assert steady.filtered(REST, 1.0) is REST
    steady.forget()
    assert steady.filtered(far, 1.01) is far
    assert steady.filtered(REST, 9.0) is REST  # after a long while
    assert steady.filtered(far, 8.0) is far  # by a clock that went back
