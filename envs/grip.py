"""Grip offsets: what the fingers must add to a demonstration's angles so that they press on the object.

A recording shows where fingers are, not how hard they press: replayed alone it drops the object. The offsets follow
from the demonstration and the object's shape alone, without simulation. Added to the reference they hold some objects
for some time; the policy's residual does the rest.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.signed_distance import signed_distance
from mjx_hand.hand.joints import TIP_LINKS
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics

_NEAR = 0.007  # m: a finger whose skin is closer than this is taken to touch
_DAMPING = 0.01  # m/rad, of the step that closes gaps
_ALONG = np.linspace(0.0, 1.0, 5)


def grip_offsets(
    angles: Float[Array, "t 20"],
    object_in_hand: tuple[Float[Array, "t 3 3"], Float[Array, "t 3"]],
    rigid: RigidHand,
    kind: str,
    size: Float[Array, "3"],
    force: float | Float[Array, ""],
    gains: Gains,
    planes: Float[Array, "h f 4"] | None = None,
) -> Float[Array, "t 20"]:
    """Hinge offsets (rad) that put each touching finger's last link on the object's surface and press it there.

    Two parts: a damped least-squares step that closes the gap (or opens it, where capture error left the finger
    inside), and dq = J^T f / kp for the force.

    The thumb presses with `force` newtons, the fingers that touch share as much between them; a hand whose thumb does
    not touch presses with its fingers only, against the palm.

    Args:
        angles: demonstrated hinge angles.
        object_in_hand: rotation and position (m) of the object in the wrist's frame.
        rigid: the twin's hand; each finger's last capsule stands for its pad.
        kind, size: the object's shape.
        force: newtons.
        gains: of the position controllers that the offsets are given to.
        planes: of a mesh (`envs.signed_distance.hull_planes`).
    """
    pads = [max(k for k, link in enumerate(rigid.capsule_links) if link == tip) for tip in TIP_LINKS]
    ends, radius = rigid.capsule_ends[jnp.array(pads)], rigid.capsule_radius[jnp.array(pads)]
    thumb = jnp.arange(5) == 4
    stiffness, limit = jnp.asarray(gains.stiffness), jnp.asarray(gains.force_limit)

    def pad_points(q: Array) -> Array:
        rot, pos = forward_kinematics(q, rigid)
        tips = jnp.array(TIP_LINKS)
        near = pos[tips] + jnp.einsum("fij,fj->fi", rot[tips], ends[:, 0])
        far = pos[tips] + jnp.einsum("fij,fj->fi", rot[tips], ends[:, 1])
        return near[:, None] + _ALONG[None, :, None] * (far - near)[:, None]

    def one(q: Array, rotation: Array, position: Array) -> Array:
        def distance(point: Array) -> Array:
            return signed_distance(kind, size, rotation.T @ (point - position), planes)

        points = pad_points(q)
        gap = jax.vmap(jax.vmap(distance))(points) - radius[:, None]
        closest = jnp.argmin(gap, axis=1)
        rows = jnp.arange(5)
        inward = -jax.vmap(jax.grad(distance))(points[rows, closest])
        touching = jax.nn.sigmoid((_NEAR - gap[rows, closest]) / 0.001)
        fingers = jnp.sum(touching * ~thumb)
        share = jnp.where(thumb, 1.0, 1.0 / jnp.maximum(fingers, 1.0)) * touching
        jacobian = jax.jacfwd(pad_points)(q)[rows, closest]  # (5, 3, 20)
        torque = jnp.einsum("fak,fa->k", jacobian, force * share[:, None] * inward)
        rows_of_gap = jnp.einsum("fak,fa->fk", jacobian, inward) * touching[:, None]
        square = rows_of_gap @ rows_of_gap.T + _DAMPING**2 * jnp.eye(5)
        closing = rows_of_gap.T @ jnp.linalg.solve(square, gap[rows, closest] * touching)
        return closing + jnp.clip(torque, -limit, limit) / stiffness

    return jax.lax.map(lambda row: one(*row), (angles, *object_in_hand), batch_size=64)
