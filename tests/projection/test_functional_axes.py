"""Functional axes: known hinges are found, what a motion does not show stays, and a real hand is followed better."""

import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array
from scipy.spatial.transform import Rotation

from mjx_hand import fit_functional_axes
from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGE_LINKS, ONE_DOF, TWO_DOF
from mjx_hand.hand.load import load_hand
from mjx_hand.projection import project
from mjx_hand.pytree import replace
from mjx_hand.retarget.sequence import rigid_hand_of
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand, joint_rotations
from mjx_hand.rotations import geodesic_angle
from tests.projection.samples import about

FRAMES = 120
FIRST = np.arange(0, 20, 4)  # abductions


@pytest.fixture(scope="module")
def rigid() -> RigidHand:
    return build_rigid_hand(load_hand())


def turned_axes(rigid: RigidHand, degrees: float, seed: int = 0) -> np.ndarray:
    """Each joint's axes turned by so much about a random line, the two of a base joint together."""
    lines = np.random.default_rng(seed).normal(size=(15, 3))
    turns = Rotation.from_rotvec(np.radians(degrees) * lines / np.linalg.norm(lines, axis=1, keepdims=True))
    return np.einsum("hij,hj->hi", turns.as_matrix()[np.array(HINGE_LINKS) - 1], rigid.hinge_axis)


def motion_angles(rigid: RigidHand, scale: float = 1.0, seed: int = 1) -> np.ndarray:
    """Smooth angles over most of each hinge's range, (FRAMES, 20)."""
    rng = np.random.default_rng(seed)
    phase, speed = rng.uniform(0, 2 * np.pi, 20), rng.uniform(1, 3, 20)
    swing = np.sin(speed * np.linspace(0, 2 * np.pi, FRAMES)[:, None] + phase)
    middle, half = (rigid.hinge_upper + rigid.hinge_lower) / 2, (rigid.hinge_upper - rigid.hinge_lower) / 2
    return np.asarray(scale * (middle + 0.8 * half * swing))


def rotations_of(rigid: RigidHand, angles: np.ndarray) -> np.ndarray:
    return np.asarray(joint_rotations(jnp.asarray(angles, jnp.float32), rigid), float)


def errors(rigid: RigidHand, rotations: np.ndarray) -> np.ndarray:
    """Degrees, (frames, 15)."""
    recorded = jnp.asarray(rotations, jnp.float32)
    return np.degrees(geodesic_angle(recorded, joint_rotations(project(recorded, rigid), rigid)))


def apart(a: np.ndarray | Array, b: np.ndarray | Array) -> np.ndarray:
    """Degrees between axes, sign and all."""
    return np.degrees(np.arccos(np.clip((np.asarray(a) * np.asarray(b)).sum(axis=-1), -1, 1)))


def noise(rng: np.random.Generator, degrees: float, count: int = FRAMES) -> np.ndarray:
    vectors = rng.normal(0, np.radians(degrees), (count * 15, 3))
    return Rotation.from_rotvec(vectors).as_matrix().reshape(count, 15, 3, 3)


@pytest.mark.parametrize("rest_rotation", [False, True])
def test_known_axes_are_found_with_their_order_and_signs(rigid, rest_rotation):
    true = replace(rigid, hinge_axis=turned_axes(rigid, 20))
    angles = motion_angles(rigid)
    rotations = rotations_of(true, angles) @ noise(np.random.default_rng(2), 1.0)
    found = fit_functional_axes(rigid, rotations, rest_rotation=rest_rotation)
    assert apart(rigid.hinge_axis, true.hinge_axis).max() > 15
    assert apart(found.hinge_axis, true.hinge_axis).max() < 2.0
    np.testing.assert_allclose(project(rotations.astype(np.float32), found), angles, atol=np.radians(8))
    np.testing.assert_array_equal(found.hinge_lower, rigid.hinge_lower)


def test_axes_need_not_be_at_right_angles(rigid):
    axes = np.array(rigid.hinge_axis)
    normal = np.cross(axes[FIRST], axes[FIRST + 1])
    axes[FIRST] = np.einsum("fij,fj->fi", about(normal, np.radians(14.0)), axes[FIRST])
    found = fit_functional_axes(rigid, rotations_of(replace(rigid, hinge_axis=axes), motion_angles(rigid)))
    between = apart(found.hinge_axis[FIRST], found.hinge_axis[FIRST + 1])
    assert (between < 87).all()  # towards 76: an opening shows in the second order only


def test_rest_rotations_are_found_and_leave_angles_counted_from_the_flat_hand(rigid):
    """A turn of 12 degrees across each joint's axes that no axis can make."""
    axes = np.asarray(rigid.hinge_axis)
    normal = np.cross(axes[FIRST], axes[FIRST + 1])
    across = np.cross(axes, np.roll(axes, 1, axis=1))
    lines = across[[h for h in range(20) if h not in FIRST]]  # a joint's last hinge
    lines[::3] = normal
    rest = about(lines / np.linalg.norm(lines, axis=1, keepdims=True), np.full(15, np.radians(12.0)))
    true = replace(rigid, rest_rotation=rest)
    angles = motion_angles(rigid)
    found = fit_functional_axes(rigid, rotations_of(true, angles))
    assert np.degrees(geodesic_angle(jnp.asarray(found.rest_rotation), jnp.asarray(rest))).max() < 1.0
    assert apart(found.hinge_axis, axes).max() < 2.0
    flat = np.tile(np.eye(3, dtype=np.float32), (15, 1, 1))
    np.testing.assert_allclose(project(flat, found), 0, atol=1e-5)


@pytest.mark.parametrize("bend", [0.0, 0.4])
def test_joints_that_hardly_move_keep_their_axes(rigid, bend):
    """Noise of a third of a degree about a posture: nothing about axes can be learned from it."""
    posture = np.tile(bend * np.tile([0.0, 1.0, 1.0, 1.0], 5), (FRAMES, 1))
    rotations = rotations_of(rigid, posture) @ noise(np.random.default_rng(3), 0.3)
    found = fit_functional_axes(rigid, rotations)
    assert apart(found.hinge_axis, rigid.hinge_axis).max() < 10
    assert errors(found, rotations).mean() < 0.6


def test_only_the_joint_that_moves_gets_new_axes(rigid):
    true = replace(rigid, hinge_axis=turned_axes(rigid, 20))
    angles = np.zeros((FRAMES, 20))
    angles[:, 2] = motion_angles(rigid)[:, 2]  # the index finger's middle joint
    found = fit_functional_axes(rigid, rotations_of(true, angles))
    assert apart(found.hinge_axis, true.hinge_axis)[2] < 1
    np.testing.assert_allclose(
        np.delete(found.hinge_axis, 2, axis=0), np.delete(rigid.hinge_axis, 2, axis=0), atol=1e-6
    )


def test_frames_far_off_count_little(rigid):
    true = replace(rigid, hinge_axis=turned_axes(rigid, 15))
    rotations = rotations_of(true, motion_angles(rigid)) @ noise(np.random.default_rng(4), 0.5)
    rotations[::10] = Rotation.random(12 * 15, rng=np.random.default_rng(5)).as_matrix().reshape(12, 15, 3, 3)
    assert np.median(apart(fit_functional_axes(rigid, rotations).hinge_axis, true.hinge_axis)) < 2.5


def test_frames_that_are_not_valid_do_not_matter(rigid):
    rotations = rotations_of(replace(rigid, hinge_axis=turned_axes(rigid, 15)), motion_angles(rigid))
    valid = np.arange(FRAMES) % 3 > 0
    spoiled = np.where(valid[:, None, None, None], rotations, np.nan)
    found = fit_functional_axes(rigid, spoiled, valid)
    again = fit_functional_axes(rigid, rotations[valid])
    np.testing.assert_array_equal(found.hinge_axis, again.hinge_axis)
    several = fit_functional_axes(rigid, spoiled.reshape(4, 30, 15, 3, 3), valid.reshape(4, 30))
    np.testing.assert_array_equal(found.hinge_axis, several.hinge_axis)


def test_a_left_hands_axes_are_the_mirror_image(rigid):
    left = build_rigid_hand(load_hand(side="left"))
    rotations = rotations_of(replace(rigid, hinge_axis=turned_axes(rigid, 20)), motion_angles(rigid))
    mirror = np.diag([-1.0, 1.0, 1.0])
    found, mirrored = fit_functional_axes(rigid, rotations), fit_functional_axes(left, mirror @ rotations @ mirror)
    np.testing.assert_allclose(mirrored.hinge_axis, -found.hinge_axis @ mirror, atol=2e-2)


@pytest.mark.parametrize("seed", range(3))
def test_no_motion_makes_axes_change_places_or_signs(rigid, seed):
    """Uniformly random rotations, which no hinges follow."""
    rotations = Rotation.random(FRAMES * 15, rng=np.random.default_rng(seed)).as_matrix().reshape(FRAMES, 15, 3, 3)
    found = np.asarray(fit_functional_axes(rigid, rotations).hinge_axis)
    own = (found * rigid.hinge_axis).sum(axis=1)
    assert own.min() > 0
    first_to_second = (found[FIRST] * rigid.hinge_axis[FIRST + 1]).sum(axis=1)
    second_to_first = (found[FIRST + 1] * rigid.hinge_axis[FIRST]).sum(axis=1)
    assert (own[FIRST] > np.abs(first_to_second)).all()
    assert (own[FIRST + 1] > np.abs(second_to_first)).all()
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-9)


def test_a_real_hand_held_out(recordings):
    """Axes from one half of the frames, errors on the other, both ways: the figures of docs/axes.md."""
    motion = load_motion(recordings / "dexmv_mustard/sequence.npz")
    rigid = rigid_hand_of(motion, load_hand())
    rotations = motion.rotations[motion.valid]
    half = len(rotations) // 2
    for fitted, held_out in ((slice(0, half), slice(half, None)), (slice(half, None), slice(0, half))):
        before = errors(rigid, rotations[held_out])
        after = errors(fit_functional_axes(rigid, rotations[fitted]), rotations[held_out])
        assert before.mean() > 7
        assert after.mean() <= 1.5
        assert after[:, ONE_DOF].mean() < 1.3
        assert after[:, TWO_DOF].mean() < 2.0
        assert after.max() < 12


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: r[:5], "5 of 5 frames are valid; axes need at least 10"),
        (lambda r: r[:0], "0 of 0 frames"),
        (lambda r: r[:, :14], r"must be \(..., 15, 3, 3\)"),
        (lambda r: r[0, 0], r"must be \(..., 15, 3, 3\)"),
        (lambda r: r * 1.1, "is off a rotation by"),
        (lambda r: -r, "is off a rotation by"),
        (
            lambda r: np.where(np.arange(FRAMES)[:, None, None, None] == 7, np.nan, r),
            r"rotations\[7, 0\] is not finite",
        ),
        (lambda r: r.astype(str), "of type"),
    ],
)
def test_recordings_that_cannot_be_used_are_named(rigid, change, message):
    rotations = rotations_of(rigid, motion_angles(rigid))
    with pytest.raises(InputError, match=message) as caught:
        fit_functional_axes(rigid, change(rotations))
    assert "\n" not in str(caught.value)


def test_valid_of_another_shape_and_too_few_are_named(rigid):
    rotations = rotations_of(rigid, motion_angles(rigid))
    with pytest.raises(InputError, match=r"valid has shape \(3,\)"):
        fit_functional_axes(rigid, rotations, np.ones(3, bool))
    with pytest.raises(InputError, match="9 of 120 frames"):
        fit_functional_axes(rigid, rotations, np.arange(FRAMES) < 9)


def test_a_hand_with_parallel_axes_is_refused(rigid):
    axes = np.array(rigid.hinge_axis)
    axes[0] = axes[1]
    with pytest.raises(InputError, match="nearly parallel"):
        fit_functional_axes(replace(rigid, hinge_axis=axes), rotations_of(rigid, motion_angles(rigid)))
