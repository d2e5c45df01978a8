"""What of a person's hand touches, of the demonstrations that come with the policies."""

import pytest

from envs.demonstrations.on_robot.pads import demonstrated_pads
from envs.demonstrations.twin_hands import twins
from mjx_hand.motion.demonstration import load_demonstration
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
