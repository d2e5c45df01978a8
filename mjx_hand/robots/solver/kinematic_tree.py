"""`KinematicTree`: any hand, human or robot, as arrays: joints that turn or slide, and points on its links.

Every joint's frame has the joint's axis as its z, so that a joint at angle θ turns by a plain rotation about z; the
frame stands at the joint's origin. Frames at rest are relative to the parent joint's frame. Joints whose motion is tied
to another's (mimic joints) share one degree of freedom: a joint's value is slope · degree of freedom + shift.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.pytree import pytree, static
from mjx_hand.robots.solver.triples import Scalars, Triple, add, columns_times, times, turned_about_z

BASE = -1  # as a joint's parent or a point's joint: the link that the hand hangs on
HELD = -1  # as a joint's degree of freedom: none, it stands still


@pytree
class KinematicTree:
    """A hand's joints, parents before children, and the points that keypoints or targets are compared with.

    Lengths metres, angles radians; a sliding joint's value is in metres.

    Attributes:
        rest_rotation, rest_position: each joint's frame in its parent's, at value zero.
        slope, shift: a joint's value = slope * its degree of freedom + shift; slope 0 for one that stands still.
        lower, upper: limits of the degrees of freedom; infinite where there is none.
        point_position: the points, in their joints' frames.
        parents: each joint's parent joint, or BASE.
        dofs: the degree of freedom that drives each joint, or HELD.
        slides: of each joint, whether it slides along its axis instead of turning about it.
        point_joints: the joint that carries each point, or BASE.
        dof_names, joint_names, point_names: what they are called.
        overruled: tied joints whose limits do not count, since they would leave the others one position.
    """

    rest_rotation: Float[np.ndarray | Array, "j 3 3"]
    rest_position: Float[np.ndarray | Array, "j 3"]
    slope: Float[np.ndarray | Array, "j"]
    shift: Float[np.ndarray | Array, "j"]
    lower: Float[np.ndarray | Array, "n"]
    upper: Float[np.ndarray | Array, "n"]
    point_position: Float[np.ndarray | Array, "p 3"]
    parents: tuple[int, ...] = static()
    dofs: tuple[int, ...] = static()
    slides: tuple[bool, ...] = static()
    point_joints: tuple[int, ...] = static()
    dof_names: tuple[str, ...] = static()
    joint_names: tuple[str, ...] = static()
    point_names: tuple[str, ...] = static()
    overruled: tuple[str, ...] = static(default=())

    @property
    def num_dofs(self) -> int:
        return len(self.dof_names)


def z_frame(axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """A rotation whose third column is the unit vector along `axis`."""
    z = np.asarray(axis, float) / np.linalg.norm(axis)
    aside = np.eye(3)[np.argmin(np.abs(z))]
    x = np.cross(aside, z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def ancestors(tree: KinematicTree, joint: int) -> tuple[int, ...]:
    """The joints that move `joint`'s frame, from the base outwards, itself the last."""
    chain: list[int] = []
    while joint != BASE:
        chain.insert(0, joint)
        joint = tree.parents[joint]
    return tuple(chain)


def joint_values(dofs: Float[np.ndarray, "*b n"], tree: KinematicTree) -> Float[np.ndarray, "*b j"]:
    """The value of every joint (rad, m), the tied ones included, in the order of `joint_names`."""
    return np.asarray(dofs)[..., list(tree.dofs)] * np.asarray(tree.slope) + np.asarray(tree.shift)


@jax.jit
def tree_points(dofs: Float[Array | np.ndarray, "*b n"], tree: KinematicTree) -> Float[Array, "*b p 3"]:
    """The points (m) in the base's frame."""
    values = jnp.asarray(dofs)
    batch = values.shape[:-1]
    flat = values.reshape(-1, tree.num_dofs)
    points = forward([flat[:, k] for k in range(tree.num_dofs)], tree).points
    rows = [jnp.stack([jnp.broadcast_to(c, flat.shape[:1]) for c in point], axis=-1) for point in points]
    return jnp.stack(rows, axis=-2).reshape(*batch, len(points), 3)


@dataclass(frozen=True)
class Base:
    """Where the base stands: its axes and its origin, in the frame that points are wanted in."""

    axes: list[Triple]
    origin: Triple


@pytree
class Placed:
    """A tree at some values: every joint's axis and origin, and the points, in one frame."""

    axes: list[Triple]
    origins: list[Triple]
    points: list[Triple]


def forward(values: Scalars, tree: KinematicTree, base: Base | None = None) -> Placed:
    """Forward kinematics.

    Args:
        values: the degrees of freedom, one array over the batch each.
        tree: the hand.
        base: where its base stands; everything is in the base's own frame if None.
    """
    rest, place = jnp.asarray(tree.rest_rotation), jnp.asarray(tree.rest_position)
    frames: dict[int, list[Triple]] = {} if base is None else {BASE: base.axes}  # each joint's three axes
    origins: dict[int, Triple] = {} if base is None else {BASE: base.origin}

    def carried(joint: int, position: Triple) -> Triple:
        return add(origins[joint], columns_times(frames[joint], position)) if joint in frames else position

    for joint, parent in enumerate(tree.parents):
        turn = [[rest[joint, row, column] for row in range(3)] for column in range(3)]
        if parent in frames:
            turn = [columns_times(frames[parent], column) for column in turn]
        origin = carried(parent, [place[joint, k] for k in range(3)])
        value = jnp.asarray(tree.shift)[joint]
        if tree.dofs[joint] != HELD:
            value = jnp.asarray(tree.slope)[joint] * values[tree.dofs[joint]] + value
        if tree.slides[joint]:
            frames[joint], origins[joint] = turn, add(origin, times(value, turn[2]))
        else:
            frames[joint], origins[joint] = turned_about_z(turn, value), origin
    positions = jnp.asarray(tree.point_position)
    points = [carried(joint, [positions[p, k] for k in range(3)]) for p, joint in enumerate(tree.point_joints)]
    joints = range(len(tree.parents))
    return Placed(
        axes=[frames[joint][2] for joint in joints], origins=[origins[joint] for joint in joints], points=points
    )
