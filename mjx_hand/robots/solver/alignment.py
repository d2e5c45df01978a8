"""Where a hand's base stands, from points on it: a start for the search when the base moves freely."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_hand.capture.keypoints.layouts import PALM
from mjx_hand.robots.solver.kinematic_tree import BASE, KinematicTree, forward
from mjx_hand.robots.solver.normal_equations import Posture
from mjx_hand.robots.solver.objectives import Objective, Targets
from mjx_hand.rotations import quaternion_to_matrix

_FINGERS = 0.05  # weight of a point on a finger, where its joints may be far from their values, beside one of the palm
_SQUARINGS = 14  # the largest eigenvalue's share grows as a power of 2^14


def aligned(values: Float[Array, "n b"], targets: Targets, tree: KinematicTree, objective: Objective) -> Posture:
    """`values` with the base turned and moved onto the targets, as far as weighted least squares can.

    Horn's closed form (J. Opt. Soc. Am. A 4(4), 1987, https://doi.org/10.1364/JOSAA.4.000629): the rotation's
    quaternion is a 4 x 4 matrix's largest eigenvector, found by squaring the matrix, which suits a batch.
    """
    batch = values.shape[1]
    if not objective.free_base:
        return Posture(
            values=values,
            rotation=jnp.broadcast_to(jnp.eye(3)[..., None], (3, 3, batch)),
            position=jnp.zeros((3, batch)),
        )
    placed = forward([values[k] for k in range(tree.num_dofs)], tree).points
    ours = jnp.stack([jnp.stack([jnp.broadcast_to(x, (batch,)) for x in placed[p]]) for p in objective.tasks])
    palm = [
        k in PALM or tree.point_joints[p] == BASE for p, k in zip(objective.tasks, objective.human_tasks, strict=True)
    ]
    weights = targets.weights * jnp.where(jnp.array(palm), 1.0, _FINGERS)[:, None]
    total = jnp.maximum(jnp.sum(weights, axis=0), 1e-20)
    centre_ours = jnp.sum(weights[:, None] * ours, axis=0) / total
    centre_theirs = jnp.sum(weights[:, None] * targets.vectors, axis=0) / total
    a, b = ours - centre_ours, targets.vectors - centre_theirs
    covariance = jnp.sum((weights[:, None] * a)[:, :, None] * b[:, None], axis=0)  # (3, 3, b)
    turn = quaternion_to_matrix(_largest_eigenvector(_quaternion_form(covariance)).T)
    rotation = jnp.moveaxis(turn, 0, -1)
    position = centre_theirs - jnp.sum(rotation * centre_ours[None], axis=1)
    return Posture(values=values, rotation=rotation, position=position)


def _quaternion_form(s: Float[Array, "3 3 b"]) -> Float[Array, "4 4 b"]:
    """Horn's matrix: quaternions q (wxyz) of good rotations make qᵀ N q large."""
    trace = s[0, 0] + s[1, 1] + s[2, 2]
    skew = [s[1, 2] - s[2, 1], s[2, 0] - s[0, 2], s[0, 1] - s[1, 0]]
    rows = [[trace, *skew]]
    for i in range(3):
        rows.append([skew[i], *(s[i, j] + s[j, i] - (trace if i == j else 0.0) for j in range(3))])
    return jnp.stack([jnp.stack(row) for row in rows])


def _largest_eigenvector(matrix: Float[Array, "4 4 b"]) -> Float[Array, "4 b"]:
    """The unit eigenvector of the largest eigenvalue of symmetric matrices; the identity's quaternion for zero ones."""
    size = jnp.sqrt(jnp.sum(matrix**2, axis=(0, 1)))
    identity = jnp.eye(4)[..., None]
    power = matrix + size * identity  # no eigenvalue is negative now, so that the largest is also the farthest from 0
    power = jnp.where(size > 0, power / jnp.maximum(size, 1e-30), jnp.zeros((4, 4, 1)).at[0, 0].set(1.0))
    for _ in range(_SQUARINGS):
        power = jnp.sum(power[:, :, None] * power[None], axis=1)
        power = power / (power[0, 0] + power[1, 1] + power[2, 2] + power[3, 3])
    column = jnp.argmax(jnp.stack([power[k, k] for k in range(4)]), axis=0)
    vector = jnp.take_along_axis(power, column[None, None], axis=1)[:, 0]
    return vector / jnp.linalg.norm(vector, axis=0)
