"""Fingers opened straight off an object: a hand that is about to close around it, or one that is not inside it."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.demonstrations.from_recording.grasp_pose import GraspPose, capsule_axes, linear_gaps
from mjx_hand.rigid.rigid_hand import RigidHand, on_device

_STEPS, _STEP, _DAMPING = 20, 0.5, 0.02  # of damped least squares (m/rad)


def pregrasp(grasps: GraspPose, hand: RigidHand, planes: Float[np.ndarray, "h f 4"], clearance: float) -> GraspPose:
    """Each of n grasps with all fingers at least `clearance` (m) off the object, as far as their limits allow."""
    rows = tuple(jnp.asarray(row, jnp.float32) for row in (grasps.angles, grasps.rotation, grasps.position))
    bare = on_device(hand)
    angles = _open_all(rows, bare, jnp.asarray(planes, jnp.float32), clearance)
    return dataclasses.replace(grasps, angles=np.asarray(angles, float))


@jax.jit
def _open_all(
    grasps: tuple[Array, Array, Array], hand: RigidHand, planes: Array, clearance: Float[Array, ""]
) -> Float[Array, "n 20"]:
    fingers = jnp.array([link > 0 for link in hand.capsule_links])

    def one(row: tuple[Array, Array, Array]) -> Array:
        def missing(q: Array) -> tuple[Array, Array]:
            gaps = linear_gaps(capsule_axes(q, row[1], row[2], hand), jnp.asarray(hand.capsule_radius), planes)
            short = jnp.where(fingers, jnp.maximum(clearance - gaps, 0.0), 0.0)
            return short, short

        def step(_: Array, q: Array) -> Array:
            slope, short = jax.jacfwd(missing, has_aux=True)(q)
            square = slope @ slope.T + _DAMPING**2 * jnp.eye(len(short))
            moved = q - _STEP * slope.T @ jnp.linalg.solve(square, short)
            return jnp.clip(moved, hand.hinge_lower, hand.hinge_upper)

        return jax.lax.fori_loop(0, _STEPS, step, row[0])

    return jax.lax.map(one, grasps, batch_size=8)
