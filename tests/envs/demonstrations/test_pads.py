"""What of a person's hand touches, of the demonstrations that come with the policies."""

import numpy as np
import pytest

from envs.demonstrations.on_robot import pads as pads_module
from envs.demonstrations.on_robot.pads import demonstrated_pads, stays_held
from envs.demonstrations.twin_hands import twins
from mjx_hand.hand.joints import HINGES
from mjx_hand.motion.demonstration import load_demonstration
from mjx_hand.pytree import replace
from train.experiment.bundled_policies import demonstration_path


@pytest.mark.parametrize(
    ("grasp", "wraps"), [("power", True), ("cylindrical", True), ("pinch", False), ("lateral", False)]
)
def test_a_hand_wraps_with_three_fingers_and_more(grasp, wraps):
    """A card lies against the palm, but only thumb and index finger hold it: taken for a hand that wraps, it was held
    by a thumb under its lower edge."""
    demonstration = load_demonstration(demonstration_path(grasp))
    pads = demonstrated_pads(demonstration, twins([demonstration])[0])
    assert pads.wraps == wraps, pads.fingers
    assert "thumb" in pads.fingers


@pytest.mark.parametrize(("opened", "holds"), [(0.08, True), (0.8, False)])
def test_in_the_air_a_finger_lets_go_only_where_it_moves_away(opened, holds, monkeypatch):
    """A thumb that a recording has a few millimetres off for a third of a second holds on: robots let cubes fall."""
    d = load_demonstration(demonstration_path("pinch"))
    thumb = HINGES.index("thumb_cmc_abduction")
    high = np.flatnonzero(d.object_pose[:, 2] > d.object_pose[0, 2] + 0.05)
    frames = slice(int(high[20]), int(high[20]) + 17)
    angles = d.motion.angles.copy()
    angles[:, thumb] += 0.1  # so that it just touches, where it was recorded inside
    angles[frames, thumb] += opened
    d = replace(d, motion=replace(d.motion, angles=angles))
    hand = twins([d])[0]
    found = demonstrated_pads(d, hand)
    assert found.in_air[frames].all()
    assert not found.in_air[:10].any()
    assert found.touching[frames, found.fingers.index("thumb")].all() == holds
    monkeypatch.setattr(pads_module, "stays_held", lambda touching, pad, in_air: np.zeros_like(touching))
    assert not demonstrated_pads(d, hand).touching[frames, 0].any(), "the thumb was not off"


def test_what_is_let_go_where_the_object_stands_is_let_go():
    """Gaps are closed only from a touch on, in the air from end to end; a hand that leaves a held object leaves it."""
    t = np.arange(60)
    touching = ((t >= 10) & (t < 20)) | ((t >= 30) & (t < 40))
    still = np.zeros((60, 3))
    np.testing.assert_array_equal(stays_held(touching, still, np.ones(60, bool)), (t >= 10) & ~touching)
    np.testing.assert_array_equal(stays_held(touching, still, t < 35), (t >= 20) & (t < 30))
    np.testing.assert_array_equal(stays_held(touching, still, t < 50), (t >= 20) & (t < 50) & ~touching)
    np.testing.assert_array_equal(stays_held(touching, still, t > 25), t >= 40)
    leaves = np.stack([0.002 * (t - 39).clip(0), 0.0 * t, 0.0 * t], axis=1)
    np.testing.assert_array_equal(stays_held(touching, leaves, np.ones(60, bool)), (t >= 20) & (t < 30))
