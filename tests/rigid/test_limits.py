import numpy as np

from mjx_hand.hand.joints import HINGES
from mjx_hand.rigid.limits import anatomical_limits


def test_the_flat_hand_lies_inside():
    lower, upper = anatomical_limits()
    assert (lower < 0).all()
    assert (upper > 0).all()


def test_ranges_are_human():
    lower, upper = anatomical_limits()
    span = dict(zip(HINGES, np.rad2deg(upper - lower), strict=True))
    assert all(35 <= degrees <= 140 for degrees in span.values())
    for finger in ("index", "middle", "ring", "pinky"):
        assert span[f"{finger}_mcp_abduction"] < span[f"{finger}_dip_flexion"] < span[f"{finger}_mcp_flexion"]
