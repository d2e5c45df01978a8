"""Limits: human ranges, soft within hard, a recording's own, and both kinds in the written descriptions."""

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest
import yourdfpy

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGES
from mjx_hand.rigid.limits import active_limits, anatomical_limits, limits_from_motion

DEGREES = np.pi / 180


@pytest.mark.parametrize("limits", [anatomical_limits, active_limits])
def test_the_flat_hand_lies_inside(limits):
    lower, upper = limits()
    assert (lower < 0).all()
    assert (upper > 0).all()


@pytest.mark.parametrize("limits", [anatomical_limits, active_limits])
def test_ranges_are_human(limits):
    lower, upper = limits()
    span = dict(zip(HINGES, np.rad2deg(upper - lower), strict=True))
    assert all(35 <= degrees <= 140 for degrees in span.values())
    for finger in ("index", "middle", "ring", "pinky"):
        assert span[f"{finger}_mcp_abduction"] < span[f"{finger}_dip_flexion"] < span[f"{finger}_mcp_flexion"]


def test_soft_limits_hold_what_daily_life_needs_and_lie_inside_the_hard_ones():
    (lower, upper), (soft_lower, soft_upper) = anatomical_limits(), active_limits()
    assert (lower <= soft_lower).all()
    assert (soft_upper <= upper).all()
    # Bain et al. 2015: MCP 19 to 71, PIP 23 to 87, DIP 10 to 64; Hayashi and Shimizu 2013: MCP -10 to 85.
    for name, least, most in (("mcp", -10, 85), ("pip", 23, 87), ("dip", 10, 64)):
        for finger in ("index", "middle", "ring", "pinky"):
            hinge = HINGES.index(f"{finger}_{name}_flexion")
            assert np.degrees(soft_lower[hinge]) <= least
            assert np.degrees(soft_upper[hinge]) >= most


def soft(rigid):
    return np.asarray(rigid.soft_lower), np.asarray(rigid.soft_upper)


def recorded_angles(rigid, share=0.5):
    """Angles that fill the given share of each hard range, (1000, 20)."""
    steps = np.linspace(0.5 - share / 2, 0.5 + share / 2, 1000)[:, None]
    return rigid.hinge_lower + steps * (rigid.hinge_upper - rigid.hinge_lower)


def test_a_recordings_range_becomes_soft(right):
    angles = recorded_angles(right)
    angles[3] = 3.0  # one frame is noise
    found = limits_from_motion(right, angles, margin=2 * DEGREES)
    lower, upper = soft(found)
    np.testing.assert_allclose(lower, angles[0] - 2 * DEGREES, atol=1 * DEGREES)
    np.testing.assert_allclose(upper, angles[-1] + 2 * DEGREES, atol=1 * DEGREES)
    np.testing.assert_array_equal(found.hinge_lower, right.hinge_lower)


def test_it_stays_within_the_hard_limits_unless_they_may_widen(right):
    angles = recorded_angles(right, share=1.4)
    kept, widened = (limits_from_motion(right, angles, widen=widen) for widen in (False, True))
    np.testing.assert_array_equal(kept.soft_lower, right.hinge_lower)
    np.testing.assert_array_equal(kept.soft_upper, right.hinge_upper)
    assert (widened.hinge_lower < right.hinge_lower).all()
    assert (widened.hinge_upper > right.hinge_upper).all()
    np.testing.assert_array_equal(widened.soft_upper, widened.hinge_upper)


@pytest.mark.parametrize("posture", [-2.0, 2.0])
def test_a_range_wholly_outside_leaves_a_strip(right, posture):
    lower, upper = soft(limits_from_motion(right, np.full((5, 20), posture)))
    assert (lower < upper).all()
    assert (lower >= right.hinge_lower).all()
    assert (upper <= right.hinge_upper).all()


def test_frames_that_are_not_valid_do_not_count(right):
    angles, valid = recorded_angles(right), np.arange(1000) < 500
    spoiled = np.where(valid[:, None], angles, np.nan)
    found, again = limits_from_motion(right, spoiled, valid), limits_from_motion(right, angles[valid])
    np.testing.assert_array_equal(found.soft_upper, again.soft_upper)


def test_input_at_fault_is_named(right):
    angles = recorded_angles(right)
    for arguments, message in (
        ((angles, np.zeros(1000, bool)), "none of 1000 frames"),
        ((angles[:0],), "none of 0 frames"),
        ((angles * np.nan,), "NaN or infinity"),
    ):
        with pytest.raises(InputError, match=message):
            limits_from_motion(right, *arguments)
    with pytest.raises(InputError, match=r"margin is -0\.1"):
        limits_from_motion(right, angles, margin=-0.1)


def test_both_kinds_are_in_the_descriptions(rigid, folder):
    robot = yourdfpy.URDF.load(str(folder / f"{rigid.side}_hand.urdf"))
    model = mujoco.MjModel.from_xml_path(str(folder / f"{rigid.side}_hand.xml"))
    for k, name in enumerate(HINGES):
        hard, yielding = [rigid.hinge_lower[k], rigid.hinge_upper[k]], [limits[k] for limits in soft(rigid)]
        joint = robot.joint_map[name]
        safety = joint.safety_controller
        np.testing.assert_allclose([joint.limit.lower, joint.limit.upper], hard, rtol=1e-6)
        np.testing.assert_allclose([safety.soft_lower_limit, safety.soft_upper_limit], yielding, rtol=1e-6)
        assert safety.k_position > 0
        assert safety.k_velocity > 0
        np.testing.assert_allclose(model.joint(name).range, hard, atol=1e-5)
        np.testing.assert_allclose(model.joint(name).user, yielding, atol=1e-5)


def test_the_wrists_joints_have_no_soft_limits(rigid, folder):
    tree = ET.parse(folder / f"{rigid.side}_hand.urdf")
    assert len(tree.findall("joint/safety_controller")) == len(HINGES)
