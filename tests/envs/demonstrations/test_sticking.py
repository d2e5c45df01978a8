"""Pads go with the object while the person's finger touches, whatever the recording's own slip, and with it before."""

import numpy as np
from scipy.spatial.transform import Rotation

from envs.demonstrations.on_robot.pads import DemonstratedPads
from envs.demonstrations.on_robot.sticking import followed_places, onto, opposed, still_near
from mjx_hand.pytree import replace

FIRST, LAST, GRASP = 40, 90, 60


def test_a_pad_sticks_while_the_finger_touches_and_follows_it_else(demonstrations):
    d = demonstrations[0]
    t = np.arange(120)
    turn = Rotation.from_rotvec(np.outer(t, [0.0, 0.004, 0.01]))
    position = np.stack([0.002 * t, np.zeros(120), 0.001 * t], axis=1)
    d = replace(d, object_pose=np.concatenate([position, turn.as_quat(scalar_first=True)], axis=1))
    own = np.stack([0.02 + 0.001 * np.sin(t / 5), np.maximum(FIRST - t, 0) * 0.001, 0.0 * t], axis=1)  # slips, comes
    places = (position + turn.apply(own))[:, None]
    touching = ((t >= FIRST) & (t < LAST))[:, None]
    pads = DemonstratedPads(
        ("thumb",), places, np.zeros((1, 3)), np.zeros((1, 3)), touching, t >= FIRST, {}, GRASP, False
    )
    off = np.array([0.001, 0.002, -0.003])
    grasp = position[GRASP] + turn[GRASP].apply(own[GRASP] + off)
    seen = turn.inv().apply(followed_places(pads, grasp[None], d)[:, 0] - position)
    well_inside = slice(FIRST + 6, LAST - 6)  # 0.1 s from its ends, at 50 frames a second
    np.testing.assert_allclose(seen[well_inside], np.tile(own[GRASP] + off, (LAST - FIRST - 12, 1)), atol=1e-9)
    outside = np.r_[0:FIRST, LAST:120]
    np.testing.assert_allclose(seen[outside], own[outside] + off, atol=1e-9)
    assert np.abs(np.diff(seen, axis=0)).max() < 0.0015  # no jolt: 1 mm a frame is the finger's own


def test_a_pad_opens_only_after_it_touched():
    """Closing begins with the touch, opening with its end: what is still held is not let go."""
    touching = np.zeros(60, bool)
    touching[20:40] = True
    near = still_near(touching, 50.0)
    assert (near[:20] == 0).all()
    assert (np.diff(near[20:31]) > 0).all()  # in 0.2 s
    assert (near[30:40] == 1).all()
    assert 0 < near[42] < 1
    assert (near[50:] == 0).all()
    assert (onto(touching, 50.0)[36:40] < 1).all()  # what goes with the object has parted from it by then


def test_no_finger_touches_alone_what_stands():
    """A thumb that comes to a bottle before a finger waits for it, and leaves with it; on the way it may be alone."""
    t = np.arange(100)
    thumb, index, ring = (t >= 10) & (t < 90), (t >= 20) & (t < 40), (t >= 60) & (t < 80)
    height = 0.1 * np.clip((t - 30) / 10, 0, 1) * np.clip((70 - t) / 10, 0, 1)  # carried from 30 to 70
    place = np.stack([0.002 * t.clip(30, 70), 0.0 * t, height], axis=1)
    fingers, opposing = np.stack([thumb, index, ring], axis=1), np.array([True, False, False])
    found = opposed(fingers, opposing, place, height > 0.005)
    np.testing.assert_array_equal(found[:, 0], (t >= 20) & (t < 80))
    np.testing.assert_array_equal(found[:, 1], index)
    np.testing.assert_array_equal(found[:, 2], ring)
    ends_in_air = opposed(fingers[:60], opposing, place[:60], height[:60] > 0.005)  # held at the end of the recording
    np.testing.assert_array_equal(ends_in_air[40:, 0], thumb[40:60])
