"""Axes and rest rotation of a joint as a few numbers around its anatomical axes: what `functional_axes` fits.

All numbers are angles (rad), zero for the anatomical joint. The rest rotation is about a line at right angles to the
joint's axes, so that the flat hand is at angle zero: more of it would only shift the angles.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_hand.projection.check import compose, turn
from mjx_hand.projection.two_dof import project_one_dof, project_two_dof
from mjx_hand.rotations import axis_angle_matrix, exp

Axes = Float[Array, "h 3"]
Matrices = Float[Array, "*b 3 3"]


@dataclass(frozen=True, eq=False)  # hashed by identity: there are two, known to jit as such
class JointKind:
    """How numbers become a joint, and rotations the joint's nearest ones.

    Attributes:
        hinges: one or two.
        turns, skews, rests: which of the numbers turn the axes, open the angle between them, and make the rest.
        joint: axes and rest rotation from the numbers and the anatomical axes.
        nearest: the rotations that hinges about `axes` make nearest to given ones.
    """

    hinges: int
    turns: slice
    skews: slice
    rests: slice
    joint: Callable[[Float[Array, "p"], Axes], tuple[Axes, Float[Array, "3 3"]]]
    nearest: Callable[[Matrices, Axes], Matrices]

    @property
    def size(self) -> int:
        """How many numbers."""
        return self.rests.stop


def _one_hinge(numbers: Float[Array, "4"], axes: Float[Array, "1 3"]) -> tuple[Axes, Float[Array, "3 3"]]:
    across = _across(axes[0])
    turned = exp(numbers[:2] @ across)
    return turn(turned, axes), exp(turn(turned, numbers[2:] @ across))


def _two_hinges(numbers: Float[Array, "5"], axes: Float[Array, "2 3"]) -> tuple[Axes, Float[Array, "3 3"]]:
    normal = jnp.cross(axes[0], axes[1])
    normal = normal / jnp.linalg.norm(normal)
    frame = jnp.stack([axes[0], jnp.cross(normal, axes[0]), normal])
    turned = exp(numbers[:3] @ frame)
    half = numbers[3] / 2
    opened = turn(axis_angle_matrix(normal, jnp.stack([-half, half])), axes)
    return turn(turned, opened), axis_angle_matrix(turn(turned, normal), numbers[4])


def _across(axis: Float[Array, "3"]) -> Float[Array, "2 3"]:
    """Two unit vectors that make a frame with a unit vector."""
    helper = jnp.eye(3, dtype=axis.dtype)[jnp.argmin(jnp.abs(axis))]
    first = jnp.cross(axis, helper)
    first = first / jnp.linalg.norm(first)
    return jnp.stack([first, jnp.cross(axis, first)])


def _nearest_one(rotations: Matrices, axes: Axes) -> Matrices:
    return axis_angle_matrix(axes[0], project_one_dof(rotations, axes[0]))


def _nearest_two(rotations: Matrices, axes: Axes) -> Matrices:
    first, second = project_two_dof(rotations, axes[0], axes[1])
    return compose(axis_angle_matrix(axes[0], first), axis_angle_matrix(axes[1], second))


ONE_HINGE = JointKind(1, slice(0, 2), slice(2, 2), slice(2, 4), _one_hinge, _nearest_one)
TWO_HINGES = JointKind(2, slice(0, 3), slice(3, 4), slice(4, 5), _two_hinges, _nearest_two)
