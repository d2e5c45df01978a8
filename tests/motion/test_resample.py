"""Motions at other frame rates, against SciPy's interpolation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from mjx_hand.errors import InputError
from mjx_hand.motion import Motion, check_motion
from mjx_hand.motion.resample import resample_motion
from mjx_hand.pytree import replace
from tests.motion.motions import motions

STILL = Motion(
    fps=30.0,
    rotations=np.tile(np.eye(3), (2, 15, 1, 1)),
    wrist_position=np.zeros((2, 3)),
    wrist_quaternion=np.tile([1.0, 0, 0, 0], (2, 1)),
    shape=np.zeros(10),
    valid=np.ones(2, bool),
)
quick = settings(deadline=None, max_examples=25)


def angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Geodesic angles (rad) between matrices."""
    turn = np.swapaxes(a, -1, -2) @ b
    return Rotation.from_matrix(turn.reshape(-1, 3, 3)).magnitude()


@quick
@given(motion=motions())
def test_the_same_rate_changes_nothing(motion):
    same = resample_motion(motion, motion.fps)
    np.testing.assert_array_equal(same.valid, motion.valid)
    good = motion.valid
    np.testing.assert_allclose(same.rotations[good], motion.rotations[good], atol=1e-9)
    np.testing.assert_allclose(same.wrist_position[good], motion.wrist_position[good], atol=1e-9)


@quick
@given(motion=motions(), factor=st.integers(2, 4))
def test_a_multiple_of_the_rate_passes_through_every_frame_and_scipys_arcs(motion, factor):
    motion = replace(motion, valid=np.ones_like(motion.valid))
    fine = resample_motion(motion, factor * motion.fps)
    assert fine.num_frames == factor * (motion.num_frames - 1) + 1
    np.testing.assert_allclose(fine.rotations[::factor], motion.rotations, atol=1e-7)
    if motion.num_frames > 1:
        times = np.arange(fine.num_frames) / factor
        arcs = Slerp(np.arange(motion.num_frames), Rotation.from_matrix(motion.rotations[:, 4]))
        assert angles(fine.rotations[:, 4], arcs(times).as_matrix()).max() < 1e-6
        for k in range(3):
            line = np.interp(times, np.arange(motion.num_frames), motion.wrist_position[:, k])
            np.testing.assert_allclose(fine.wrist_position[:, k], line, atol=1e-9)


@quick
@given(motion=motions(max_frames=12), ratio=st.floats(0.3, 3.0))
def test_any_rate_gives_a_well_formed_motion_valid_only_between_valid_frames(motion, ratio):
    found = resample_motion(motion, ratio * motion.fps)
    if found.valid.any():
        check_motion(found)
    frame = np.arange(found.num_frames) / ratio
    near = [motion.valid[int(np.floor(f + 1e-6))] and motion.valid[int(np.ceil(f - 1e-6))] for f in frame]
    np.testing.assert_array_equal(found.valid, near)
    assert frame[-1] <= motion.num_frames - 1 + 1e-6


@pytest.mark.parametrize("fps", [0.0, -5.0, np.nan, np.inf])
def test_rates_that_are_none_are_refused(fps):
    with pytest.raises(InputError, match="expected a positive number"):
        resample_motion(STILL, fps)
