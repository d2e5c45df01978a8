"""From the 15 rotations of a MANO pose to the 20 hinge angles of the rigid hand."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Shaped

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, NUM_BALL_JOINTS, NUM_HINGES
from mjx_hand.projection.bch import bch2_two_dof
from mjx_hand.projection.check import check_rotations
from mjx_hand.projection.naive import naive_one_dof, naive_two_dof
from mjx_hand.projection.one_dof import project_one_dof
from mjx_hand.projection.paper import paper_one_dof, paper_two_dof
from mjx_hand.projection.two_dof import project_two_dof
from mjx_hand.rigid.rigid_hand import RigidHand

# For a one-hinge and for a two-hinge joint. The series of "bch2" has nothing to add for one hinge.
METHODS = {
    "exact": (project_one_dof, project_two_dof),
    "paper": (paper_one_dof, paper_two_dof),
    "bch2": (project_one_dof, bch2_two_dof),
    "naive": (naive_one_dof, naive_two_dof),
}


def project(
    rotations: Shaped[Array | np.ndarray, "..."], rigid: RigidHand, method: str = "exact"
) -> Float[Array, "*b 20"]:
    """The hinge angles (rad) whose joint rotations come nearest to `rotations`, joint by joint.

    The inverse of `joint_rotations` on what the hinges can reach. Limits are not applied.

    Args:
        rotations: the pose, (..., 15, 3, 3): each joint's rotation relative to its parent, in MANO's order.
        rigid: the hand whose `hinge_axis` is used.
        method: "exact", the least-squares solution in closed form; the others are for comparison: "paper",
            arXiv 2512.07359 as printed; "bch2", its iteration one order further; "naive", the logarithm's components.

    Raises:
        InputError: for an unknown method, another shape, or (outside jit, vmap and grad, where values are known)
            matrices that are not rotations to 1e-3.
    """
    if method not in METHODS:
        raise InputError(f"method {method!r} is unknown: choose one of {', '.join(METHODS)}")
    rotations = check_rotations(rotations, NUM_BALL_JOINTS)
    return _project(rotations, jnp.asarray(rigid.hinge_axis, rotations.dtype), method)


@partial(jax.jit, static_argnames="method")
def _project(rotations: Float[Array, "*b 15 3 3"], hinge_axis: Float[Array, "20 3"], method: str) -> Array:
    one_dof, two_dof = METHODS[method]
    batch = rotations.shape[:-3]
    # A finger's three joints have four hinges: two at its base, one at each of the others.
    joints = rotations.reshape(*batch, len(FINGERS), 3, 3, 3)
    axes = hinge_axis.reshape(len(FINGERS), 4, 3)
    abduction, flexion = two_dof(joints[..., 0, :, :], axes[:, 0], axes[:, 1])
    outer = one_dof(joints[..., 1:, :, :], axes[:, 2:])
    angles = jnp.concatenate([abduction[..., None], flexion[..., None], outer], axis=-1)
    return angles.reshape(*batch, NUM_HINGES)
