"""A small kinematic tree of every kind of joint, for tests."""

import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.robots.solver.kinematic_tree import BASE, KinematicTree


def small_tree() -> KinematicTree:
    """A base with two fingers: turning, sliding and tied joints."""
    rng = np.random.default_rng(4)
    turns = Rotation.random(6, rng=rng).as_matrix()
    return KinematicTree(
        rest_rotation=turns.astype(np.float32),
        rest_position=rng.uniform(-0.04, 0.04, (6, 3)).astype(np.float32),
        slope=np.array([1, 1, -0.7, 1, 1, 1.3], np.float32),
        shift=np.array([0, 0, 0.2, 0, 0, -0.1], np.float32),
        lower=np.full(4, -2, np.float32),
        upper=np.full(4, 2, np.float32),
        point_position=rng.uniform(-0.05, 0.05, (4, 3)).astype(np.float32),
        parents=(BASE, 0, 1, BASE, 3, 4),
        dofs=(0, 1, 1, 2, 3, 3),  # two joints of a finger share one; the last, too
        slides=(False, False, False, False, True, False),
        point_joints=(BASE, 2, 5, 4),
        dof_names=("a", "b", "c", "d"),
        joint_names=tuple("uvwxyz"),
        point_names=tuple("pqrs"),
    )
