import numpy as np
import pytest

from mjx_hand.hand.joints import FINGERS, HINGES
from mjx_hand.rigid.axes import anatomical_axes
from mjx_hand.rigid.rigid_hand import finger_tips, forward_kinematics

FLEXIONS = [k for k, name in enumerate(HINGES) if name.endswith("flexion")]
ABDUCTIONS = [k for k, name in enumerate(HINGES) if name.endswith("abduction")]
PALMAR = np.array([0.0, -1.0, 0.0])


def tip_motion(rigid, hinge, angle=0.2):
    """How the hinge's own finger tip moves (m)."""
    finger = hinge // 4
    moved = np.zeros((2, 20), np.float32)
    moved[1, hinge] = angle
    tips = np.asarray(finger_tips(moved, rigid))
    return tips[1, finger] - tips[0, finger]


def test_axes_are_orthonormal(rigid):
    axes = rigid.hinge_axis
    np.testing.assert_allclose(np.linalg.norm(axes, axis=-1), 1, atol=1e-12)
    for k in ABDUCTIONS:
        assert abs(axes[k] @ axes[k + 1]) < 1e-12


@pytest.mark.parametrize("hinge", FLEXIONS, ids=lambda k: HINGES[k])
def test_positive_flexion_closes_the_hand(rigid, hinge):
    motion = tip_motion(rigid, hinge)
    if FINGERS[hinge // 4] != "thumb":
        assert motion @ PALMAR > 0.5 * np.linalg.norm(motion)
        return
    # The thumb opposes: its tip moves palmwards or across the palm, towards the little finger's base.
    _, centres = forward_kinematics(np.zeros(20, np.float32), rigid)
    tip = np.asarray(finger_tips(np.zeros(20, np.float32), rigid))[4]
    little = np.asarray(centres)[7] + 0.02 * PALMAR
    towards = (little - tip) / np.linalg.norm(little - tip)
    assert motion @ towards > 0.3 * np.linalg.norm(motion)


@pytest.mark.parametrize("hinge", ABDUCTIONS, ids=lambda k: HINGES[k])
def test_positive_abduction_is_ulnar_for_fingers_and_radial_for_the_thumb(rigid, hinge):
    sign = 1 if FINGERS[hinge // 4] == "thumb" else -1
    motion = tip_motion(rigid, hinge)
    assert sign * motion[2] > 0.5 * np.linalg.norm(motion)  # +z is the thumb's side, for both sides


def test_left_mirrors_right(left, right):
    mirror = np.array([-1.0, 1.0, 1.0])
    angles = np.random.default_rng(0).uniform(-0.5, 0.9, (3, 20)).astype(np.float32)
    np.testing.assert_allclose(finger_tips(angles, left), finger_tips(angles, right) * mirror, atol=2e-6)
    np.testing.assert_allclose(left.link_mass, right.link_mass, rtol=1e-5)
    np.testing.assert_allclose(left.link_com, right.link_com * mirror, atol=1e-6)
    np.testing.assert_allclose(left.link_inertia, right.link_inertia * np.outer(mirror, mirror), atol=1e-10)
    np.testing.assert_allclose(left.capsule_radius, right.capsule_radius, atol=1e-6)


def test_thumb_turn_is_a_rotation_about_the_bone(right):
    centres = np.cumsum(np.random.default_rng(0).normal(size=(16, 3)), axis=0)  # any skeleton will do
    bone = centres[14] - centres[15]
    flat, turned = (anatomical_axes(centres, "right", turn)[-1] for turn in (0.0, 0.3))
    assert abs(flat @ bone) < 1e-9
    assert abs(turned @ bone) < 1e-9
    np.testing.assert_allclose(np.cross(flat, turned) @ bone / np.linalg.norm(bone), np.sin(0.3), atol=1e-9)
