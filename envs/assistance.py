"""The virtual object controller: a spring that helps the object along its reference while training begins."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_hand.rotations import quaternion_difference


def assistance(
    object_pose: Float[Array, "7"],
    speed: Float[Array, "6"],
    now: Float[Array, "7"],
    wanted: Float[Array, "7"],
    fps: float,
    inertia: Float[Array, "2"],
    stiffness: Float[Array, ""],
) -> Float[Array, "6"]:
    """Its force (N, world) and torque (N m, the object's axes), critically damped.

    Args:
        object_pose: of the object (m, wxyz, world).
        speed: linear in the world (m/s), angular in the object's axes (rad/s).
        now, wanted: its reference at this frame and at the next.
        fps: frames a second.
        inertia: the object's mass (kg) and mean moment of inertia (kg m2).
        stiffness: 1/s^2.
    """
    damping = 2 * jnp.sqrt(stiffness)
    moving = (wanted[:3] - now[:3]) * fps
    turn = quaternion_difference(object_pose[3:], wanted[3:])
    turning = quaternion_difference(now[3:], wanted[3:]) * fps
    force = stiffness * (wanted[:3] - object_pose[:3]) + damping * (moving - speed[:3])
    torque = stiffness * turn + damping * (turning - speed[3:])
    return jnp.concatenate([inertia[0] * force, inertia[1] * torque])
