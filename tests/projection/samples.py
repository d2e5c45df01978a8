"""Axes, poses and an independent solver for the projection's tests. SciPy rotations only: no code under test."""

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from mjx_hand.rigid.rigid_hand import RigidHand


def about(axis, angle):
    return Rotation.from_rotvec(np.asarray(axis) * np.asarray(angle)[..., None]).as_matrix()


def random_rotations(count, seed):
    return Rotation.random(count, rng=np.random.default_rng(seed)).as_matrix()


def axis_pairs(count, seed, overlap):
    """Unit axes with the given scalar product, (count, 2, 3)."""
    frame = random_rotations(count, seed)
    first, second = frame[:, :, 0], overlap * frame[:, :, 0] + np.sqrt(1 - overlap**2) * frame[:, :, 1]
    return np.stack([first, second], axis=1)


def hinge_axes(seed, overlap=0.0):
    """Twenty axes laid out as a hand's: a pair at each base with this scalar product, and two hinges beyond."""
    return np.concatenate([axis_pairs(5, seed, overlap), axis_pairs(5, seed + 1, 0.9)], axis=1).reshape(20, 3)


def hand_with_axes(hinge_axis):
    """A rigid hand of which only the axes matter."""
    return RigidHand(
        wrist_position=np.zeros(3),
        link_offset=np.zeros((16, 3)),
        hinge_axis=hinge_axis,
        hinge_lower=np.full(20, -1.0),
        hinge_upper=np.full(20, 1.0),
        tip_offset=np.zeros((5, 3)),
        link_mass=np.ones(16),
        link_com=np.zeros((16, 3)),
        link_inertia=np.tile(np.eye(3), (16, 1, 1)),
        capsule_ends=np.zeros((1, 2, 3)),
        capsule_radius=np.ones(1),
        mesh_vertices=(),
        mesh_faces=(),
        capsule_links=(0,),
        side="right",
        name="axes only",
    )


def anatomical_poses(count, seed, off_axis_degrees=10.0):
    """Angles in a hand's range and, for `hinge_axes`, rotations of the five base joints turned off their axes."""
    rng = np.random.default_rng(seed)
    angles = np.stack([rng.uniform(-0.4, 0.4, (count, 5)), rng.uniform(-0.4, 1.6, (count, 5))], axis=-1)
    return angles, Rotation.from_rotvec(
        np.radians(off_axis_degrees) * rng.normal(size=(count * 5, 3))
    ).as_matrix().reshape(count, 5, 3, 3)


def angle_between(a, b):
    """Degrees."""
    chord = np.linalg.norm(np.asarray(a, float) - np.asarray(b, float), axis=(-2, -1))
    return np.degrees(2 * np.arcsin(np.minimum(chord / np.sqrt(8), 1.0)))


def residual(rotation, axes, angles):
    """Degrees between the rotation and what the hinges make of the angles (last axis)."""
    axes, angles = np.asarray(axes, float), np.asarray(angles, float)
    made = about(axes[..., 0, :], angles[..., 0])
    for k in range(1, axes.shape[-2]):
        made = made @ about(axes[..., k, :], angles[..., k])
    return angle_between(rotation, made)


def best_residual(rotation, axes, starts=2, grid=25):
    """The smallest residual (degrees) that SciPy finds for one rotation from the best points of a dense grid."""
    ticks = np.linspace(-np.pi, np.pi, grid, endpoint=False)
    points = np.stack(np.meshgrid(*[ticks] * len(axes)), axis=-1).reshape(-1, len(axes))
    made = about(axes[0], points[:, 0])
    if len(axes) == 2:
        made = made @ about(axes[1], points[:, 1])
    order = np.argsort(np.sum((made - rotation) ** 2, axis=(-2, -1)))

    def error(x):
        made = about(axes[0], x[0])
        return ((made @ about(axes[1], x[1]) if len(axes) == 2 else made) - rotation).ravel()

    # The grid's best neighbours share a basin; every tenth point gives the others a chance.
    tries = [least_squares(error, points[i], xtol=1e-14, ftol=1e-14, gtol=1e-14) for i in order[: 10 * starts : 10]]
    return float(residual(rotation, axes, min(tries, key=lambda fit: fit.cost).x))
