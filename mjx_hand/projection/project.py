"""From the 15 rotations of a MANO pose to the 20 hinge angles of the rigid hand."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Shaped

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, NUM_BALL_JOINTS, NUM_HINGES
from mjx_hand.projection.check import check_rotations, compose
from mjx_hand.projection.paper import bch2_two_dof, naive_one_dof, naive_two_dof, paper_one_dof, paper_two_dof
from mjx_hand.projection.two_dof import nearest_within, project_one_dof, project_two_dof, project_two_dof_within
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.rotations import axis_angle_matrix

# For a one-hinge and for a two-hinge joint. The series of "bch2" has nothing to add for one hinge.
METHODS = {
    "exact": (project_one_dof, project_two_dof),
    "paper": (paper_one_dof, paper_two_dof),
    "bch2": (project_one_dof, bch2_two_dof),
    "naive": (naive_one_dof, naive_two_dof),
}


def project(
    rotations: Shaped[Array | np.ndarray, "..."],
    rigid: RigidHand,
    method: str = "exact",
    *,
    carry: bool = False,
    limits: bool = False,
) -> Float[Array, "*b 20"]:
    """The hinge angles (rad) whose joint rotations come nearest to `rotations`.

    The inverse of `joint_rotations` on what the hinges can reach. Each joint is projected by itself; with `carry`,
    what a joint's hinges could not follow is first given to the next joint of the finger, so that errors of a link's
    orientation in the wrist's frame do not add up along the finger.

    Args:
        rotations: the pose, (..., 15, 3, 3): each joint's rotation relative to its parent, in MANO's order.
        rigid: the hand whose `hinge_axis` and `rest_rotation` (and limits) are used.
        method: "exact", the least-squares solution in closed form; the others are for comparison: "paper",
            arXiv 2512.07359 as printed; "bch2", its iteration one order further; "naive", the logarithm's components.
        carry: give each joint's residual rotation to its child before projecting that.
        limits: stop at the hand's limits. "exact" is then the least-squares solution within them; of the others,
            each angle goes to the limit that is nearest on the circle.

    Raises:
        InputError: for an unknown method, another shape, or (outside jit, vmap and grad, where values are known)
            matrices that are not rotations to 1e-3.
    """
    if method not in METHODS:
        raise InputError(f"method {method!r} is unknown: choose one of {', '.join(METHODS)}")
    rotations = check_rotations(rotations, NUM_BALL_JOINTS)
    axis, lower, upper = (
        jnp.asarray(a, rotations.dtype) for a in (rigid.hinge_axis, rigid.hinge_lower, rigid.hinge_upper)
    )
    rest = None if rigid.rest_rotation is None else jnp.asarray(rigid.rest_rotation, rotations.dtype)
    return _project(rotations, axis, rest, lower, upper, method, carry, limits)


@partial(jax.jit, static_argnames=("method", "carry", "limits"))
def _project(
    rotations: Float[Array, "*b 15 3 3"],
    hinge_axis: Float[Array, "20 3"],
    rest: Float[Array, "15 3 3"] | None,
    lower: Float[Array, "20"],
    upper: Float[Array, "20"],
    method: str,
    carry: bool,
    limits: bool,
) -> Array:
    batch = rotations.shape[:-3]
    if rest is not None:
        rotations = compose(rotations, jnp.swapaxes(rest, -1, -2))  # what the hinges alone should make
        rest = rest.reshape(len(FINGERS), 3, 3, 3)
    # A finger's three joints have four hinges: two at its base, one at each of the others.
    joints = rotations.reshape(*batch, len(FINGERS), 3, 3, 3)
    axes, lower, upper = (a.reshape(len(FINGERS), 4, *a.shape[1:]) for a in (hinge_axis, lower, upper))

    def hinge(rotation: Array, at: slice | int) -> Array:
        angle = METHODS[method][0](rotation, axes[:, at])
        return nearest_within(angle, lower[:, at], upper[:, at]) if limits else angle

    angles = list(_base(joints[..., 0, :, :], axes, lower, upper, method, limits))
    if carry:
        made = compose(axis_angle_matrix(axes[:, 0], angles[0]), axis_angle_matrix(axes[:, 1], angles[1]))
        left = joints[..., 0, :, :]
        for k in (2, 3):
            residual = compose(jnp.swapaxes(made, -1, -2), left)
            if rest is not None:  # from the parent's frame before its rest rotation to the frame after it
                before = rest[:, k - 2]
                residual = compose(compose(jnp.swapaxes(before, -1, -2), residual), before)
            left = compose(residual, joints[..., k - 1, :, :])
            angles.append(hinge(left, k))
            made = axis_angle_matrix(axes[:, k], angles[k])
    else:
        angles += list(jnp.moveaxis(hinge(joints[..., 1:, :, :], slice(2, 4)), -1, 0))
    return jnp.stack(angles, axis=-1).reshape(*batch, NUM_HINGES)


def _base(rotation: Array, axes: Array, lower: Array, upper: Array, method: str, limits: bool) -> tuple[Array, Array]:
    """Abduction and flexion of each finger's first joint."""
    if limits and method == "exact":
        return project_two_dof_within(rotation, axes[:, 0], axes[:, 1], lower[:, :2], upper[:, :2])
    first, second = METHODS[method][1](rotation, axes[:, 0], axes[:, 1])
    if not limits:
        return first, second
    return nearest_within(first, lower[:, 0], upper[:, 0]), nearest_within(second, lower[:, 1], upper[:, 1])
