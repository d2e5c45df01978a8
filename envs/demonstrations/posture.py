"""Closed grasp postures: least squares over hinge angles and wrist pose, many hands and object sizes at once."""

from collections.abc import Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import nnls

from envs.grasps import GraspType
from envs.signed_distance import half_extents, signed_distance
from mjx_hand.hand.joints import LINKS, NUM_HINGES
from mjx_hand.pytree import pytree
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics, stack_hands
from mjx_hand.rotations import exp

_STEPS = 60
_BATCH = 16  # hands a compiled call, so that any number of hands compiles once
_ALONG = jnp.linspace(0.0, 1.0, 4)  # where along each capsule's axis distances are taken
_OPENING_DAMPING = 0.01  # m/rad
# What one unit of residual is worth (m, rad).
_TOUCH, _SLIDE, _CLEAR, _SWAY, _TILT = 0.0005, 0.004, 0.001, 0.5, 0.3


@pytree
class Posture:
    """A hand closed on an object whose centre is the origin, axes parallel to the world's.

    Attributes:
        angles: hinge angles (rad).
        rotation: world_from_hand.
        position: the wrist relative to the object's centre (m).
        touch_error: largest distance (m) of a contact from where it should be.
        contact_jacobian: velocity (m/rad) of each contact's point on the skin by hinge.
        contact_point: that point relative to the object's centre (m).
    """

    angles: Float[Array, "*b 20"]
    rotation: Float[Array, "*b 3 3"]
    position: Float[Array, "*b 3"]
    touch_error: Float[Array, "*b"]
    contact_jacobian: Float[Array, "*b c 3 20"]
    contact_point: Float[Array, "*b c 3"]


def solve_postures(grasp: GraspType, hands: Sequence[RigidHand], sizes: Float[np.ndarray, "n 3"]) -> Posture:
    """The posture of each hand on an object of the size beside it (leading axis n)."""
    parts = []
    for start in range(0, len(hands), _BATCH):
        rows = [min(start + k, len(hands) - 1) for k in range(_BATCH)]  # the last batch repeats its last hand
        parts.append(_solve_all(grasp, stack_hands([hands[k] for k in rows]), jnp.asarray(sizes[rows], jnp.float32)))
    return jax.tree.map(lambda *leaves: jnp.concatenate(leaves)[: len(hands)], *parts)


def squeeze_angles(grasp: GraspType, posture: Posture, gains: Gains) -> Float[np.ndarray, "20"]:
    """Hinge offsets (rad) that press with balanced forces: dq = J^T f / kp, for one posture.

    The first contact presses with `grasp.squeeze` newtons; the others share the answer so that the sum of forces and of
    moments about the object's centre is least. Without that balance a harder squeeze makes a pinch worse.
    """
    inward = -np.array([contact.normal for contact in grasp.contacts])
    points, jacobian = np.asarray(posture.contact_point), np.asarray(posture.contact_jacobian)
    arm = np.abs(points).max()
    wrench = np.concatenate([inward, np.cross(points, inward) / arm], axis=1).T  # (6, contacts)
    shares = np.concatenate([[1.0], nnls(wrench[:, 1:], -wrench[:, 0])[0]])
    torque = np.einsum("cak,ca->k", jacobian, grasp.squeeze * shares[:, None] * inward)
    return np.clip(torque, -gains.force_limit, gains.force_limit) / gains.stiffness


def opening_angles(grasp: GraspType, posture: Posture) -> Float[np.ndarray, "20"]:
    """Hinge offsets (rad) that take each contact `grasp.opening` metres straight off its face: damped least squares.

    Fingers that leave, and so arrive, along the face's normal touch without pushing the object aside.
    """
    normals = np.array([contact.normal for contact in grasp.contacts])
    jacobian = np.asarray(posture.contact_jacobian).reshape(-1, NUM_HINGES)
    square = jacobian @ jacobian.T + _OPENING_DAMPING**2 * np.eye(len(jacobian))
    return jacobian.T @ np.linalg.solve(square, grasp.opening * normals.ravel())


@partial(jax.jit, static_argnums=0)
def _solve_all(grasp: GraspType, hands: RigidHand, sizes: Array) -> Posture:
    return jax.vmap(partial(_solve, grasp))(hands, sizes)


def _solve(grasp: GraspType, hand: RigidHand, size: Array) -> Posture:
    capsule_links = hand.capsule_links
    capsules = [_last_capsule(contact.link, capsule_links) for contact in grasp.contacts]
    along = jnp.array([contact.along for contact in grasp.contacts])
    normals = jnp.array([contact.normal for contact in grasp.contacts])
    aside = jnp.array([contact.aside for contact in grasp.contacts])
    seed_angles, seed_rotation = jnp.array(grasp.posture), jnp.array(grasp.wrist_rotation)
    radius = hand.capsule_radius
    slack = jnp.full(len(capsule_links), 0.001).at[jnp.array(capsules)].set(-0.0003)
    support = jnp.array(grasp.support)
    below = jnp.array([0.0, 0.0, -half_extents(grasp.object_kind, size)[2] - support[2]])  # the block's centre

    def axis_points(x: Array) -> Array:
        """World points on the capsules' axes, (capsules, along, 3)."""
        rot, pos = forward_kinematics(x[:NUM_HINGES], hand)
        links = jnp.array(capsule_links)
        ends = pos[links][:, None] + jnp.einsum("cij,cej->cei", rot[links], hand.capsule_ends)
        points = ends[:, :1] + _ALONG[None, :, None] * (ends[:, 1:] - ends[:, :1])
        return points @ _rotation(x, seed_rotation).T + x[-3:]

    def contacts(x: Array) -> Array:
        """World points of the contacting capsules' axes, (contacts, 3)."""
        points = axis_points(x)[jnp.array(capsules)]
        return points[:, 0] + along[:, None] * (points[:, -1] - points[:, 0])

    def touch(x: Array) -> Array:
        target = normals * (jnp.abs(normals) @ half_extents(grasp.object_kind, size))[:, None] + aside
        target += normals * radius[jnp.array(capsules)][:, None]
        return contacts(x) - target

    def residual(x: Array) -> Array:
        gap = touch(x)
        towards = jnp.sum(gap * normals, axis=-1)
        points = axis_points(x)
        clear = signed_distance(grasp.object_kind, size, points) - (radius + slack)[:, None]
        lowest = points[..., 2] - (below[2] - support[2]) - radius[:, None] - 0.002
        block = signed_distance("box", support, points - below) - radius[:, None] - 0.002
        angles = x[:NUM_HINGES]
        outside = jnp.maximum(angles - hand.hinge_upper, 0) + jnp.maximum(hand.hinge_lower - angles, 0)
        return jnp.concatenate(
            [
                towards / _TOUCH,
                ((gap - towards[:, None] * normals) / _SLIDE).ravel(),
                jnp.minimum(clear, 0).ravel() / _CLEAR,
                jnp.minimum(lowest, 0).ravel() / _CLEAR,
                jnp.minimum(block, 0).ravel() / _CLEAR,
                (angles - seed_angles) / _SWAY,
                outside / 0.02,
                x[NUM_HINGES : NUM_HINGES + 3] / _TILT,
            ]
        )

    start = jnp.concatenate([seed_angles, jnp.zeros(6)])
    # Begin with the contacts' centre on the object's: from there the solver needs no other guess.
    start = start.at[-3:].add(-contacts(start).mean(axis=0))
    x = _levenberg_marquardt(residual, start)

    def skin_points(angles: Array) -> Array:
        held = x.at[:NUM_HINGES].set(angles)
        rot = jax.lax.stop_gradient(normals) * radius[jnp.array(capsules)][:, None]
        return contacts(held) - rot

    angles = jnp.clip(x[:NUM_HINGES], hand.hinge_lower, hand.hinge_upper)
    return Posture(
        angles=angles,
        rotation=_rotation(x, seed_rotation),
        position=x[-3:],
        touch_error=jnp.abs(jnp.sum(touch(x) * normals, axis=-1)).max(),
        contact_jacobian=jax.jacfwd(skin_points)(angles),
        contact_point=skin_points(angles),
    )


def _levenberg_marquardt(residual, x):  # type: ignore[no-untyped-def]
    """A fixed number of damped Gauss-Newton steps; a step that makes things worse is not taken."""

    def step(carry, _):  # type: ignore[no-untyped-def]
        x, damping = carry
        r, j = residual(x), jax.jacfwd(residual)(x)
        normal = j.T @ j
        delta = jnp.linalg.solve(normal + damping * jnp.diag(jnp.diag(normal) + 1e-3), -j.T @ r)
        better = jnp.sum(residual(x + delta) ** 2) < jnp.sum(r**2)
        return (jnp.where(better, x + delta, x), jnp.where(better, damping / 3, damping * 4)), None

    return jax.lax.scan(step, (x, jnp.asarray(1e-2)), length=_STEPS)[0][0]


def _rotation(x: Array, seed: Array) -> Array:
    return exp(x[NUM_HINGES : NUM_HINGES + 3]) @ seed


def _last_capsule(link: str, capsule_links: tuple[int, ...]) -> int:
    return max(k for k, owner in enumerate(capsule_links) if LINKS[owner] == link)
