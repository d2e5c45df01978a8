"""Filling gaps, against SciPy's interpolation."""

import numpy as np
from hypothesis import given, settings
from scipy.spatial.transform import Rotation, Slerp

from mjx_hand.motion.gaps import fill_lines, fill_turns, short_gaps, spans
from tests.motion.motions import motions


@settings(deadline=None, max_examples=30)
@given(motion=motions(max_frames=12))
def test_lines_match_numpy_and_keep_what_was_recorded(motion):
    frames, good = np.arange(motion.num_frames), np.flatnonzero(motion.valid)
    spoilt = np.where(motion.valid[:, None], motion.wrist_position, np.nan)
    filled = fill_lines(spoilt, motion.valid)
    for k in range(3):
        np.testing.assert_allclose(filled[:, k], np.interp(frames, good, spoilt[good, k]), atol=1e-12)
    np.testing.assert_array_equal(filled[good], spoilt[good])


@settings(deadline=None, max_examples=30)
@given(motion=motions(max_frames=12))
def test_turns_match_scipys_slerp_and_do_not_jump_in_sign(motion):
    frames, good = np.arange(motion.num_frames), np.flatnonzero(motion.valid)
    spoilt = np.where(motion.valid[:, None], motion.wrist_quaternion, 0.0)
    filled = fill_turns(spoilt, motion.valid)
    known = Rotation.from_quat(spoilt[good], scalar_first=True)
    if len(good) == 1:
        expected = Rotation.concatenate([known] * motion.num_frames)
    else:
        expected = Slerp(good, known)(np.clip(frames, good[0], good[-1]))
    angle = (Rotation.from_quat(filled, scalar_first=True).inv() * expected).magnitude()
    assert angle.max() < 1e-6
    assert (np.sum(filled[1:] * filled[:-1], axis=1) >= -1e-9).all()


def test_lengths_of_gaps_are_counted_exactly():
    visible = np.array([[0, 1, 0, 1, 0, 0, 1, 0, 0, 0, 1, 0]], bool).T
    for longest, expected in ((0, []), (1, [2]), (2, [2, 4, 5]), (3, [2, 4, 5, 7, 8, 9])):
        np.testing.assert_array_equal(np.flatnonzero(short_gaps(visible, longest)), expected)


def test_spans_are_the_runs_with_their_ends():
    assert spans(np.array([1, 1, 0, 1, 0, 0, 1], bool)) == [(0, 2), (3, 4), (6, 7)]
    assert spans(np.zeros(3, bool)) == []
