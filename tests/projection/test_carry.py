"""Residual carry-over: what a joint cannot follow is its child's to mend."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.projection import project
from mjx_hand.rigid.rigid_hand import joint_rotations
from tests.projection.samples import about, angle_between, hand_with_axes, hinge_axes, random_rotations

RIGID = hand_with_axes(hinge_axes(50, overlap=0.2))


def link_rotations(rotations):
    """Orientation of each link in the wrist's frame, by finger and joint, in plain matrix products."""
    joints = np.asarray(rotations, float).reshape(-1, 5, 3, 3, 3)
    first = joints[:, :, 0]
    second = first @ joints[:, :, 1]
    return np.stack([first, second, second @ joints[:, :, 2]], axis=2)


def noisy_poses(count, seed, degrees):
    rng = np.random.default_rng(seed)
    angles = rng.uniform(-0.4, 1.2, (count, 20))
    off = Rotation.from_rotvec(np.radians(degrees) * rng.normal(size=(count * 15, 3))).as_matrix()
    return np.asarray(joint_rotations(angles, RIGID), float) @ off.reshape(count, 15, 3, 3)


def test_what_the_hinges_reach_comes_back_as_without():
    angles = np.random.default_rng(51).uniform(-0.4, 1.2, (20, 20))
    np.testing.assert_allclose(project(joint_rotations(angles, RIGID), RIGID, carry=True), angles, atol=5e-5)


def test_each_joint_is_the_best_for_its_links_orientation_given_the_joints_before_it():
    """SciPy-free oracle: no small change of a carried angle brings its link nearer to the recorded orientation."""
    poses = noisy_poses(20, 52, 10.0)
    with jax.enable_x64(True):
        angles = np.asarray(project(poses, RIGID, carry=True))
        wanted = link_rotations(poses)

        def errors(angles):
            made = link_rotations(joint_rotations(angles, RIGID))
            return angle_between(wanted, made).reshape(-1, 15)

        at = errors(angles)
        for hinge in range(20):
            finger, k = divmod(hinge, 4)
            link = 3 * finger + max(k - 1, 0)
            for step in (-1e-3, 1e-3):
                moved = angles.copy()
                moved[:, hinge] += step
                assert np.all(errors(moved)[:, link] >= at[:, link] - 1e-9)


def test_outer_links_point_better_than_without():
    poses = noisy_poses(200, 53, 8.0)
    wanted = link_rotations(poses)
    alone, carried = (
        angle_between(wanted, link_rotations(joint_rotations(project(poses, RIGID, carry=c), RIGID)))
        for c in (False, True)
    )
    np.testing.assert_allclose(carried[:, :, 0], alone[:, :, 0], atol=1e-3)  # nothing comes before the first joint
    assert carried[:, :, 1].mean() < alone[:, :, 1].mean()
    assert carried[:, :, 2].mean() < 0.95 * alone[:, :, 2].mean()


@pytest.mark.parametrize("rotation", [np.eye(3), about(RIGID.hinge_axis[1], np.array(np.pi - 1e-3))])
@pytest.mark.parametrize("carry", [False, True])
def test_gradients_through_the_whole_pose_are_those_of_finite_differences(rotation, carry):
    with jax.enable_x64(True):
        pose = jnp.asarray(np.tile(rotation, (15, 1, 1)) @ about(np.array([0.6, 0.0, 0.8]), np.full(15, 1e-3)))
        weight = jnp.asarray(np.random.default_rng(54).normal(size=20))

        def total(vectors):
            turned = jax.vmap(lambda v, r: jax.scipy.linalg.expm(jnp.cross(jnp.eye(3), -v)) @ r)(vectors, pose)
            return jnp.sum(weight * jnp.sin(project(turned, RIGID, carry=carry)))

        slope = np.asarray(jax.grad(total)(jnp.zeros((15, 3))))
        direction = np.random.default_rng(55).normal(size=(15, 3))
        h = 1e-6
        expected = (total(h * direction) - total(-h * direction)) / (2 * h)
        assert np.isfinite(slope).all()
        assert np.sum(slope * direction) == pytest.approx(float(expected), rel=1e-5, abs=1e-6)


def test_leading_axes_and_vmap():
    poses = random_rotations(60, 56).reshape(2, 2, 15, 3, 3)
    whole = project(poses, RIGID, carry=True, limits=True)
    assert whole.shape == (2, 2, 20)
    one = jax.vmap(jax.vmap(lambda r: project(r, RIGID, carry=True, limits=True)))(jnp.asarray(poses))
    np.testing.assert_allclose(one, whole, atol=1e-5)
