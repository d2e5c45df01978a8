"""Retargeting whole sequences: what the hinges can reach comes back, what they cannot is measured right."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import ONE_DOF, TWO_DOF
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Motion
from mjx_hand.pytree import replace
from mjx_hand.retarget.sequence import retarget_errors, retarget_sequence, rigid_hand_of
from mjx_hand.rigid.bone_lengths import with_link_offsets
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand, joint_rotations

FRAMES = 122


@pytest.fixture(scope="module")
def rigid() -> RigidHand:
    return build_rigid_hand(load_hand())


def motion_of(rotations, valid=None, side="right", link_offset=None) -> Motion:
    frames = len(rotations)
    return Motion(
        fps=30.0,
        rotations=np.asarray(rotations, float),
        wrist_position=np.zeros((frames, 3)),
        wrist_quaternion=np.tile([1.0, 0, 0, 0], (frames, 1)),
        shape=np.zeros(10),
        valid=np.ones(frames, bool) if valid is None else valid,
        link_offset=link_offset,
        side=side,
    )


def angles_within_limits(rigid) -> np.ndarray:
    rng = np.random.default_rng(0)
    return rng.uniform(rigid.hinge_lower, rigid.hinge_upper, (FRAMES, 20))


def test_what_the_hinges_can_reach_comes_back(rigid):
    angles = angles_within_limits(rigid)
    motion = motion_of(joint_rotations(jnp.asarray(angles), rigid))
    found = retarget_sequence(motion, rigid)
    np.testing.assert_allclose(found.angles, angles, atol=2e-4)
    errors = retarget_errors(motion, found, rigid)
    assert errors.rotation.max() < 5e-4
    assert errors.tip_position.max() < 1e-4


def test_errors_are_those_of_rotations_added_by_hand(rigid):
    """A known turn on top of a known pose, with the angles left alone: its angle and the tips' way are known."""
    angles = angles_within_limits(rigid)
    reached = np.asarray(joint_rotations(jnp.asarray(angles), rigid), float)
    extra = Rotation.from_rotvec([0.0, 0.3, 0.0]).as_matrix()
    turned = reached.copy()
    turned[:, 2] = reached[:, 2] @ extra  # index3, the last link
    found = retarget_sequence(motion_of(reached), rigid)
    errors = retarget_errors(motion_of(turned), found, rigid)
    np.testing.assert_allclose(errors.rotation[:, 2], 0.3, atol=1e-3)
    assert np.delete(errors.rotation, 2, axis=1).max() < 1e-3
    assert errors.joint_position.max() < 1e-4  # turning the last link moves no joint
    tip = np.asarray(rigid.tip_offset[0])
    np.testing.assert_allclose(errors.tip_position[:, 0], np.linalg.norm(extra @ tip - tip), atol=1e-4)


def test_gaps_do_not_count_and_angles_bridge_them(rigid):
    angles = np.linspace(rigid.hinge_lower, rigid.hinge_upper, FRAMES)
    rotations = np.array(joint_rotations(jnp.asarray(angles), rigid), float)
    valid = np.ones(FRAMES, bool)
    valid[[0, 1, 30, 31, 32, -1]] = False
    rotations[~valid] = 7.0  # no rotations: what stands in a gap must not matter
    motion = motion_of(rotations, valid)
    found = retarget_sequence(motion, rigid)
    np.testing.assert_array_equal(found.valid, valid)
    np.testing.assert_allclose(found.angles[2:-1], angles[2:-1], atol=2e-4)  # they were straight lines
    np.testing.assert_array_equal(found.angles[0], found.angles[2])
    np.testing.assert_array_equal(found.angles[-1], found.angles[-2])
    errors = retarget_errors(motion, found, rigid)
    assert errors.rotation[~valid].max() == 0
    assert errors.rotation[valid].max() < 5e-4


def test_every_method_is_measured_and_exact_is_best_in_rotation(rigid, recordings):
    motion = load_motion(recordings / "dexmv_mustard/sequence.npz")
    own = rigid_hand_of(motion, load_hand())
    mean = {
        method: np.degrees(retarget_errors(motion, retarget_sequence(motion, own, method), own).rotation)
        for method in ("exact", "paper", "bch2", "naive")
    }
    assert (mean["exact"].mean(axis=0) <= np.min([m.mean(axis=0) for m in mean.values()], axis=0) + 1e-3).all()
    # The paper's axes on this recording; a wrong joint order, frame or axis is far outside.
    assert 6 < mean["exact"][:, TWO_DOF].mean() < 9
    assert 5 < mean["exact"][:, ONE_DOF].mean() < 8


def test_a_recordings_own_bones_become_the_hands(rigid, recordings):
    motion = load_motion(recordings / "dexmv_mustard/sequence.npz")
    own = rigid_hand_of(motion, load_hand())
    np.testing.assert_array_equal(own.link_offset, motion.link_offset)
    assert np.degrees(np.arccos(np.sum(own.hinge_axis * rigid.hinge_axis, axis=1))).max() < 45  # alike, not the same
    assert not np.allclose(own.hinge_axis, rigid.hinge_axis, atol=1e-3)
    np.testing.assert_array_equal(own.link_mass, rigid.link_mass)


def test_bones_of_the_same_hand_change_nothing(rigid):
    same = with_link_offsets(rigid, rigid.link_offset)
    np.testing.assert_allclose(same.hinge_axis, rigid.hinge_axis, atol=1e-6)
    np.testing.assert_allclose(same.tip_offset, rigid.tip_offset, atol=1e-9)


def test_tips_follow_the_last_bones_length(rigid):
    offset = np.array(rigid.link_offset)
    offset[3] *= 1.25  # index
    scaled = with_link_offsets(rigid, offset)
    lengths = np.linalg.norm(scaled.tip_offset, axis=1) / np.linalg.norm(rigid.tip_offset, axis=1)
    np.testing.assert_allclose(lengths, [1.25, 1, 1, 1, 1], atol=1e-9)


@pytest.mark.parametrize(
    ("offset", "message"),
    [
        (np.ones((15, 3)), "link_offset has shape"),
        (np.full((16, 3), np.nan), "finite"),
        (np.zeros((16, 3)), "at least 1 mm"),
    ],
)
def test_bones_that_cannot_be_are_refused(rigid, offset, message):
    with pytest.raises(InputError, match=message):
        with_link_offsets(rigid, offset)


def test_wrong_side_and_wrong_pair_are_refused(rigid):
    flat = motion_of(np.tile(np.eye(3), (4, 15, 1, 1)))
    with pytest.raises(InputError, match="a left hand"):
        rigid_hand_of(replace(flat, side="left"), load_hand())
    longer = retarget_sequence(motion_of(np.tile(np.eye(3), (FRAMES, 15, 1, 1))), rigid)
    with pytest.raises(InputError, match="the motion has 4 frames"):
        retarget_errors(flat, longer, rigid)
