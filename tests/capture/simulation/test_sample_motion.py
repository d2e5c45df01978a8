import numpy as np
import pytest

from mjx_hand.capture.simulation.sample_motion import SEQUENCE, sample_motion
from mjx_hand.errors import InputError
from mjx_hand.motion import check_motion
from mjx_hand.projection import project
from mjx_hand.retarget.sequence import rigid_hand_of
from mjx_hand.rigid.postures import postures


def test_it_goes_through_its_postures_within_limits(hand):
    shape = [1.0, -1.0]
    motion = sample_motion(hand, shape, seconds=1.0, fps=100.0, off_axis=0.0)
    check_motion(motion)
    rigid = rigid_hand_of(motion, hand)
    angles = np.asarray(project(motion.rotations, rigid))
    assert np.all(angles > np.asarray(rigid.hinge_lower) - 1e-4)
    assert np.all(angles < np.asarray(rigid.hinge_upper) + 1e-4)
    fist = postures(np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper))["fist"][0]
    at = SEQUENCE.index("fist") / (len(SEQUENCE) - 1) * (motion.num_frames - 1)
    np.testing.assert_allclose(angles[round(at)], fist, atol=0.01)
    np.testing.assert_allclose(angles[[0, -1]], 0.0, atol=1e-4)


def test_the_seed_decides_what_hinges_cannot_follow(hand):
    first, again, other = (sample_motion(hand, seconds=0.5, seed=seed).rotations for seed in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.01


@pytest.mark.parametrize(("seconds", "fps"), [(0.001, 100.0), (1.0, -5.0), (float("inf"), 100.0), (1.0, float("nan"))])
def test_no_frames(hand, seconds, fps):
    with pytest.raises(InputError, match="give two frames or more"):
        sample_motion(hand, seconds=seconds, fps=fps)
