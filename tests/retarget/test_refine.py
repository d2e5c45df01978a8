"""Refinement: tips go where they are wanted, no further than needed, within limits, and contacts count most."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.hand.load import load_hand
from mjx_hand.projection import project
from mjx_hand.pytree import replace
from mjx_hand.retarget.finger_chain import by_finger, finger_chains, finger_places
from mjx_hand.retarget.refine import RefineWeights, recorded_places, refine_angles
from mjx_hand.retarget.sequence import rigid_hand_of
from mjx_hand.retarget.small_systems import solve_positive
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand, finger_tips, forward_kinematics, joint_rotations

COUNT = 64


@pytest.fixture(scope="module")
def rigid() -> RigidHand:
    return build_rigid_hand(load_hand())


def poses(rigid, seed=0, inside=0.15):
    rng = np.random.default_rng(seed)
    span = rigid.hinge_upper - rigid.hinge_lower
    return rng.uniform(rigid.hinge_lower + inside * span, rigid.hinge_upper - inside * span, (COUNT, 20))


def turned_off_axis(angles, rigid, degrees, seed=1):
    rng = np.random.default_rng(seed)
    off = Rotation.from_rotvec(np.radians(degrees) * rng.normal(size=(COUNT * 15, 3))).as_matrix()
    return np.asarray(joint_rotations(angles, rigid), float) @ off.reshape(COUNT, 15, 3, 3)


def test_places_are_those_of_the_hands_kinematics_and_slopes_those_of_differences(rigid):
    angles = poses(rigid)
    tilt = Rotation.from_rotvec(0.1 * np.random.default_rng(3).normal(size=(15, 3))).as_matrix()
    rigid = replace(rigid, rest_rotation=tilt)
    with jax.enable_x64(True):
        chains = finger_chains(rigid)
        places, slopes = finger_places(by_finger(angles), chains)
        position = np.asarray(forward_kinematics(angles, rigid)[1])
        joints = position[:, 1:].reshape(COUNT, 5, 3, 3)[:, :, 1:]
        np.testing.assert_allclose(places[:, :, :2], joints, atol=1e-12)
        np.testing.assert_allclose(places[:, :, 2], finger_tips(angles, rigid), atol=1e-12)
        h = 1e-6
        for hinge in range(4):
            step = np.zeros(4)
            step[hinge] = h
            ahead, behind = (finger_places(by_finger(angles) + s * step, chains)[0] for s in (1, -1))
            np.testing.assert_allclose(slopes[:, :, :, hinge], (ahead - behind) / (2 * h), atol=1e-9)


def test_small_systems_are_numpys():
    rng = np.random.default_rng(2)
    for size in (1, 4, 6):
        factor = rng.normal(size=(30, size, size + 2))
        matrix, right = factor @ factor.swapaxes(1, 2), rng.normal(size=(30, size))
        with jax.enable_x64(True):
            found = solve_positive(jnp.asarray(matrix), jnp.asarray(right))
        np.testing.assert_allclose(found, np.linalg.solve(matrix, right[..., None])[..., 0], rtol=1e-8)


def test_what_the_hinges_reach_is_left_alone(rigid):
    angles = poses(rigid)
    places = recorded_places(joint_rotations(angles, rigid), rigid)
    np.testing.assert_allclose(refine_angles(angles.astype(np.float32), places, rigid), angles, atol=1e-4)


def test_tips_go_where_they_are_wanted(rigid):
    rotations = turned_off_axis(poses(rigid), rigid, 5.0)
    angles, places = project(rotations, rigid), recorded_places(rotations, rigid)
    refined = np.asarray(refine_angles(angles, places, rigid))
    before, after = (
        np.linalg.norm(finger_tips(a, rigid) - places[:, :, 2], axis=-1) for a in (np.asarray(angles), refined)
    )
    stopped = ((refined < rigid.hinge_lower + 1e-4) | (refined > rigid.hinge_upper - 1e-4)).reshape(COUNT, 5, 4)
    free = ~stopped.any(axis=-1)
    assert free.mean() > 0.8
    assert before[free].mean() > 3e-3
    assert after[free].mean() < 6e-4


def test_no_fit_of_scipys_is_better(rigid):
    """The same objective in plain NumPy, minimised by SciPy within the limits from the same start."""
    rotations = turned_off_axis(poses(rigid), rigid, 6.0)[:12]
    start = np.asarray(project(rotations, rigid, limits=True), float)
    places = np.asarray(recorded_places(rotations, rigid), float)
    contact = np.zeros((12, 5, 3))
    contact[:, 0] = [0.0, 3.0, 0.0]
    weights = RefineWeights(joint=0.3, angle=0.004)
    found = np.asarray(refine_angles(start.astype(np.float32), places.astype(np.float32), rigid, contact, weights))
    axes, offset = np.asarray(rigid.hinge_axis, float).reshape(5, 4, 3), np.asarray(rigid.link_offset)[1:]

    def residuals(q, frame, finger):
        turn = [Rotation.from_rotvec(angle * axis).as_matrix() for angle, axis in zip(q, axes[finger], strict=True)]
        bones = [*offset.reshape(5, 3, 3)[finger, 1:], np.asarray(rigid.tip_offset)[finger]]
        at, rotation, points = offset.reshape(5, 3, 3)[finger, 0], turn[0], []
        for k in range(3):
            rotation = rotation @ turn[k + 1]
            at = at + rotation @ bones[k]
            points.append(at)
        off = np.array(points) - places[frame, finger]
        away = q - start[frame, 4 * finger : 4 * finger + 4]
        return np.concatenate([0.3 * off[0], 0.3 * off[1], off[2], [contact[frame, finger] @ off[2]], 0.004 * away])

    ours, best = np.zeros((12, 5)), np.zeros((12, 5))
    for frame, finger in np.ndindex(12, 5):
        part = slice(4 * finger, 4 * finger + 4)
        bounds = rigid.hinge_lower[part], rigid.hinge_upper[part]
        inner = np.clip(start[frame, part], bounds[0] + 1e-9, bounds[1] - 1e-9)
        fit = least_squares(residuals, inner, bounds=bounds, args=(frame, finger), xtol=1e-12, ftol=1e-12)
        best[frame, finger] = fit.cost
        ours[frame, finger] = 0.5 * np.sum(residuals(found[frame, part].astype(float), frame, finger) ** 2)
    # Five iterations are all but converged, except for a few fingers that slide along a limit.
    assert np.quantile(ours / best, 0.9) < 1.001
    assert (ours / best).max() < 2
    assert ours.sum() < 1.05 * best.sum()


def test_limits_hold_and_out_of_reach_is_as_near_as_can_be(rigid):
    places = np.asarray(recorded_places(joint_rotations(poses(rigid), rigid), rigid)) * 1.3  # no finger is so long
    found = np.asarray(refine_angles(np.full((COUNT, 20), 3.0, np.float32), places, rigid))
    assert np.all(found >= rigid.hinge_lower - 1e-6)
    assert np.all(found <= rigid.hinge_upper + 1e-6)
    assert np.isfinite(found).all()


def test_a_contact_is_kept_along_its_normal(rigid):
    """Tips that no finger reaches: with a normal given, what cannot be reached lies across it."""
    rotations = turned_off_axis(poses(rigid), rigid, 12.0)
    angles, places = project(rotations, rigid), np.array(recorded_places(rotations, rigid))
    places[:, :, 2] += [0.0, 0.0, 0.02]
    normal = np.tile([0.0, 1.0, 0.0], (COUNT, 5, 1))
    off = [
        np.abs(finger_tips(refine_angles(angles, places, rigid, c), rigid)[..., 1] - places[:, :, 2, 1]).mean()
        for c in (None, 10 * normal)
    ]
    assert off[1] < 0.3 * off[0]


def test_real_sequence_within_two_millimetres_of_the_persons_own_tips(recordings):
    """Against the file's own tips, in the camera's frame: bones, tip offsets and hinges of the hand fitted to it."""
    path = recordings / "dexmv_mustard" / "sequence.npz"
    motion = load_motion(path)
    own = rigid_hand_of(motion, load_hand())
    angles = project(motion.rotations.astype(np.float32), own)
    refined = refine_angles(angles, recorded_places(motion.rotations.astype(np.float32), own), own)
    with np.load(path) as file:
        order = [str(name) for name in file["joint_order"]]
        tips = file["joints"][:, [order.index(f"{f}_tip") for f in ("index", "middle", "pinky", "ring", "thumb")]]
    wrist = Rotation.from_quat(motion.wrist_quaternion, scalar_first=True).as_matrix()
    before, after = (
        np.linalg.norm(
            motion.wrist_position[:, None] + np.einsum("tij,tfj->tfi", wrist, finger_tips(a, own)) - tips, axis=-1
        )
        for a in (angles, refined)
    )
    assert before.mean() > 4e-3
    assert after.mean() < 1.5e-3
