"""Grip offsets: what the fingers must add to a demonstration's angles so that they press on the object.

A recording shows where fingers are, not how hard they press: replayed alone it drops the object. The offsets follow
from the demonstration and the object's shape alone, without simulation. Added to the reference they hold some objects
for some time; the policy's residual does the rest.

A hand that wraps an object closes instead: its phalanges touch all around, where J^T f of a push along the surface's
normal hardly turns a joint, and what holds is that every flexing joint pulls (docs/demonstrations.md has figures).

The same press is computed in two more places, each from other contacts: `envs.model_grip` for any body from the C
engine's distances between its geoms, which are no capsules, and `envs.live.twin.grip` for one state in real time from
the engine's own list of contacts. What trained policies rely on is this one, to the bit.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.model_grip import SURE, WRAPS
from mjx_hand.hand.joints import FINGERS, FLEXES, LINKS
from mjx_hand.objects.primitives import signed_distance
from mjx_hand.rigid.capsules import capsule_points
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand

_NEAR = 0.007  # m: a phalanx whose skin is closer than this is taken to touch
_DAMPING = 0.01  # m/rad, of the step that closes gaps
_ALONG = np.linspace(0.0, 1.0, 5)


def grip_offsets(
    angles: Float[Array, "t j"],
    object_in_hand: tuple[Float[Array, "t 3 3"], Float[Array, "t 3"]],
    rigid: RigidHand,
    kind: str,
    size: Float[Array, "3"],
    force: float | Float[Array, ""],
    gains: Gains,
    planes: Float[Array, "h f 4"] | None = None,
    wrap_torque: float = 0.0,
) -> Float[Array, "t j"]:
    """Hinge offsets (rad) that put each touching phalanx on the object's surface and press it there.

    Two parts: a damped least-squares step that closes gaps (or opens them, where capture error left a finger inside),
    and dq = J^T f / kp for the force.

    The thumb presses with `force` newtons, the fingers that touch share as much between them, and each spreads its
    share over its phalanges that touch; a hand whose thumb does not touch presses with its fingers only, against the
    palm.

    Args:
        angles: demonstrated hinge angles.
        object_in_hand: rotation and position (m) of the object in the wrist's frame.
        rigid: the twin's hand; its capsules stand for its skin.
        kind, size: the object's shape.
        force: newtons.
        gains: of the position controllers that the offsets are given to.
        planes: of a mesh (`mjx_hand.objects.primitives.hull_planes`).
        wrap_torque: share of its torque limit with which every flexing joint closes in place of all that, while three
            fingers or more touch with two phalanges each; with 0 a hand that wraps presses like any other.
    """
    pads = jnp.array([k for k, link in enumerate(rigid.capsule_links) if link > 0])
    links = [LINKS[link] for link in rigid.capsule_links if link > 0]
    belongs = [[link.startswith(finger) for finger in FINGERS] for link in links]
    of_finger = jnp.asarray(belongs, jnp.float32)  # (capsules, fingers)
    thumb = jnp.array([finger == "thumb" for finger in FINGERS])
    radius = rigid.capsule_radius[pads]
    stiffness, limit = jnp.asarray(gains.stiffness), jnp.asarray(gains.force_limit)
    rows = jnp.arange(len(links))

    def axis_points(q: Array) -> Array:
        return capsule_points(q, rigid, _ALONG)[pads]

    def one(q: Array, rotation: Array, position: Array) -> Array:
        def distance(point: Array) -> Array:
            return signed_distance(kind, size, rotation.T @ (point - position), planes)

        points = axis_points(q)
        gaps = jax.vmap(jax.vmap(distance))(points) - radius[:, None]
        closest = jnp.argmin(gaps, axis=1)
        gap = gaps[rows, closest]
        inward = -jax.vmap(jax.grad(distance))(points[rows, closest])
        touching = jax.nn.sigmoid((_NEAR - gap) / 0.001)
        phalanges = touching @ of_finger  # how many of each finger touch
        touches = jnp.minimum(phalanges, 1.0)
        of_hand = jnp.where(thumb, touches, touches / jnp.maximum(jnp.sum(touches * ~thumb), 1.0))
        share = touching * (of_finger @ (of_hand / jnp.maximum(phalanges, 1.0)))
        jacobian = jax.jacfwd(axis_points)(q)[rows, closest]  # (capsules, 3, joints)
        torque = jnp.einsum("cak,ca->k", jacobian, force * share[:, None] * inward)
        rows_of_gap = jnp.einsum("cak,ca->ck", jacobian, inward) * touching[:, None]
        square = rows_of_gap @ rows_of_gap.T + _DAMPING**2 * jnp.eye(len(links))
        closing = rows_of_gap.T @ jnp.linalg.solve(square, gap * touching)
        pressing = closing + jnp.clip(torque, -limit, limit) / stiffness
        if not wrap_torque:
            return pressing
        around = jnp.sum(jnp.clip(phalanges - 1.0, 0.0, 1.0) * ~thumb)
        wraps = jax.nn.sigmoid((around - WRAPS) / SURE)
        return (1 - wraps) * pressing + wraps * wrap_torque * limit * np.array(FLEXES) / stiffness

    return jax.lax.map(lambda row: one(*row), (angles, *object_in_hand), batch_size=64)
