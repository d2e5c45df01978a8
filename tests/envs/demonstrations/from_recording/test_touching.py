"""A posture corrected: on a pinch of known contacts that capture put off."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import GraspPose, capsule_gaps, last_phalanges
from envs.demonstrations.from_recording.touching import DEPTH, corrected, gaps_over_time, touching_shares
from envs.demonstrations.scripted.grasp_posture import solve_postures
from envs.grasps import grasp_type
from mjx_hand.hand.joints import FINGERS
from mjx_hand.hand.load import load_hand
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.rigid.build import build_rigid_hand

HALF, FPS, FRAMES = 0.017, 50.0, 70
TOUCH = [FINGERS.index(finger) for finger in ("thumb", "index", "middle")]


@pytest.fixture(scope="module")
def pinch():
    hand = build_rigid_hand(load_hand())
    corners = HALF * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    description = ObjectDescription(kind="mesh", size=np.full(3, HALF), mass=0.1, friction=0.9, hulls=corners[None])
    posture = solve_postures(grasp_type("pinch"), [hand], [description])
    rotation = Rotation.from_matrix(np.asarray(posture.rotation[0], float)).as_matrix().T
    angles = np.asarray(posture.angles[0], float)
    return hand, hull_planes(corners[None]), angles, rotation, rotation @ -np.asarray(posture.position[0], float)


def test_tips_that_touch_lie_on_the_surface_and_nothing_is_inside(pinch):
    hand, planes, angles, rotation, position = pinch
    off = np.stack([angles + 0.08 * np.sin(np.arange(20) + k / 20) for k in range(FRAMES)])
    lies = GraspPose(off, np.tile(rotation, (FRAMES, 1, 1)), np.tile(position + 0.003, (FRAMES, 1)))
    before = gaps_over_time(lies, hand, planes)
    one = capsule_gaps(off[7], rotation, position + 0.003, hand, planes)
    np.testing.assert_allclose(before[7], np.asarray(one), atol=1e-5)
    assert before.min() < -0.004
    handled = np.ones(FRAMES, bool)
    shares = touching_shares(before, hand, handled, FPS)
    assert (shares[30, TOUCH] > 0.9).all()
    assert shares[30, FINGERS.index("pinky")] == 0
    held = corrected(lies, shares, hand, planes, FPS, 6.0)
    after = gaps_over_time(held, hand, planes)
    assert after.min() > -DEPTH
    assert np.abs(after[:, last_phalanges(hand)][:, TOUCH]).mean() < 0.001
    assert np.abs(held.angles - off).mean() < 0.1  # near what was recorded
    assert np.linalg.norm(held.position - lies.position, axis=1).mean() < 0.006
    assert np.abs(np.diff(held.angles, axis=0)).max() < 0.05


def test_a_hand_that_is_away_stays_as_it_was(pinch):
    hand, planes, angles, rotation, position = pinch
    lies = GraspPose(
        np.tile(angles, (8, 1)), np.tile(rotation, (8, 1, 1)), np.tile(position - np.array([0, 0.3, 0]), (8, 1))
    )
    held = corrected(lies, np.zeros((8, 5)), hand, planes, FPS, 6.0)
    np.testing.assert_allclose(held.angles, lies.angles, atol=1e-4)
    np.testing.assert_allclose(held.position, lies.position, atol=1e-5)
