"""Options of sequences: whole turns, limits, smoothing with gaps, carry and refinement, one call for many."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.pytree import replace
from mjx_hand.retarget.hands import KinematicHands
from mjx_hand.retarget.options import RetargetOptions
from mjx_hand.retarget.sequence import errors_of_many, retarget_errors, retarget_many, retarget_sequence, rigid_hand_of
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand, joint_rotations
from tests.retarget.test_sequence import motion_of

FRAMES = 122
OPTIONS = ((False, "none", None), (True, "none", None), (False, "tips", None), (False, "none", 5.0))


@pytest.fixture(scope="module")
def rigid() -> RigidHand:
    return build_rigid_hand(load_hand())


def slow_angles(rigid, frames=FRAMES, seed=0):
    rng = np.random.default_rng(seed)
    wave = 0.5 + 0.4 * np.sin(np.linspace(0, 4, frames)[:, None] * rng.uniform(0.5, 1.5, 20) + rng.uniform(0, 6, 20))
    return rigid.hinge_lower + wave * (rigid.hinge_upper - rigid.hinge_lower)


def motion_with(rigid, angles, off_axis=0.0, seed=1, **kwargs):
    rng = np.random.default_rng(seed)
    count = len(angles)
    off = Rotation.from_rotvec(off_axis * rng.normal(size=(count * 15, 3))).as_matrix().reshape(count, 15, 3, 3)
    return motion_of(np.asarray(joint_rotations(angles, rigid), float) @ off, **kwargs)


def test_a_hinge_that_turns_round_and_round_has_no_jumps(rigid):
    """Rotations of a PIP joint that pass ±π, with a gap: the course goes on and does not jump by 2π."""
    angles = np.zeros((FRAMES, 20))
    angles[:, 2] = np.linspace(-2.0, 9.0, FRAMES)
    angles[:, 0] = np.linspace(2.5, 3.8, FRAMES)
    valid = np.ones(FRAMES, bool)
    valid[40:45] = False
    found = retarget_sequence(motion_with(rigid, angles, valid=valid), rigid)
    assert np.abs(np.diff(found.angles, axis=0)).max() < 0.2
    np.testing.assert_allclose(np.diff(found.angles[:, 2]), np.diff(angles[:, 2]), atol=2e-3)


def test_limits_hold_with_every_option(rigid):
    wild = np.random.default_rng(2).normal(size=(FRAMES, 15, 3))
    motion = motion_of(Rotation.from_rotvec(wild.reshape(-1, 3)).as_matrix().reshape(FRAMES, 15, 3, 3))
    choices = (RetargetOptions(limits=True, carry=c, refine=r, smooth=s) for c, r, s in OPTIONS)
    for options in choices:
        found = retarget_many([motion], [rigid], options)[0].angles
        assert np.all(found >= rigid.hinge_lower - 1e-5), options
        assert np.all(found <= rigid.hinge_upper + 1e-5), options


def test_smoothing_takes_noise_out_and_gaps_spread_nothing(rigid):
    truth = slow_angles(rigid)
    valid = np.ones(FRAMES, bool)
    valid[50:60] = False
    clean = motion_with(rigid, truth, valid=valid)
    noisy = motion_with(rigid, truth, off_axis=0.05, valid=valid)
    rough, filtered = (retarget_sequence(noisy, rigid, smooth=s).angles for s in (None, 3.0))
    assert np.abs(filtered - truth)[valid].mean() < 0.6 * np.abs(rough - truth)[valid].mean()
    broken = replace(clean, rotations=np.where(valid[:, None, None, None], clean.rotations, 7.0))
    spoilt = retarget_sequence(broken, rigid, smooth=3.0)
    same = retarget_sequence(clean, rigid, smooth=3.0)
    assert np.isfinite(spoilt.angles).all()
    np.testing.assert_array_equal(spoilt.angles, same.angles)
    np.testing.assert_allclose(np.linalg.norm(same.wrist_quaternion, axis=1), 1, atol=1e-6)


def test_refinement_brings_the_tips_and_counts_as_rotation(rigid):
    motion = motion_with(rigid, slow_angles(rigid), off_axis=0.06)
    before, after = (
        retarget_errors(motion, retarget_sequence(motion, rigid, refine=r), rigid) for r in ("none", "tips")
    )
    assert after.tip_position.mean() < 0.4 * before.tip_position.mean()  # more where no limit stops it
    assert after.rotation.mean() > before.rotation.mean()  # the projection's were the least


def test_many_at_once_are_as_one_by_one():
    """Different lengths and people in one call; each equal to itself alone, and to its own built hand's."""
    hands = KinematicHands()
    motions = []
    for k, frames in enumerate((FRAMES, 40, 300)):
        shape = np.full(10, 0.4 * k - 0.5)
        empty = replace(motion_of(np.tile(np.eye(3), (frames, 15, 1, 1))), shape=shape)
        own = hands.of(empty)
        motions.append(replace(empty, rotations=motion_with(own, slow_angles(own, frames, k), 0.05).rotations))
    rigids = [hands.of(motion) for motion in motions]
    options = RetargetOptions(carry=True, refine="tips")
    together = retarget_many(motions, rigids, options)
    errors = errors_of_many(motions, together, rigids)
    for motion, rigid, joints, error in zip(motions, rigids, together, errors, strict=True):
        alone = retarget_sequence(motion, rigid, carry=True, refine="tips")
        np.testing.assert_allclose(joints.angles, alone.angles, atol=1e-5)
        built = rigid_hand_of(motion, load_hand())
        np.testing.assert_allclose(rigid.link_offset, built.link_offset, atol=1e-9)
        np.testing.assert_allclose(rigid.tip_offset, built.tip_offset, atol=1e-9)
        np.testing.assert_allclose(rigid.hinge_axis, built.hinge_axis, atol=1e-9)
        expected = retarget_errors(motion, alone, built)
        np.testing.assert_allclose(error.tip_position, expected.tip_position, atol=1e-6)
        np.testing.assert_allclose(error.rotation, expected.rotation, atol=1e-4)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "guess"}, "method 'guess' is unknown"),
        ({"refine": "toes"}, "refine is 'toes': choose one of none, tips"),
        ({"smooth": -1.0}, "give a positive cut-off"),
        ({"smooth": 20.0}, "cut-off is 20.0 Hz; for 30 frames/s"),
    ],
)
def test_options_out_of_range_are_refused(rigid, options, message):
    with pytest.raises(InputError, match=message):
        retarget_sequence(motion_of(np.tile(np.eye(3), (4, 15, 1, 1))), rigid, **options)
