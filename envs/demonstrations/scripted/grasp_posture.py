"""Closed grasp postures: least squares over hinge angles and wrist pose, many hands and object sizes at once."""

from collections.abc import Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import nnls

from envs.grasps import GraspType, Pads, Wrap
from envs.grasps.grasp_type import closing_torque
from mjx_hand.hand.joints import LINKS, NUM_HINGES
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.primitives import face_along, half_extents, hull_planes, signed_distance
from mjx_hand.pytree import pytree
from mjx_hand.rigid.capsules import axis_distance, capsule_points, finger_pairs, last_capsule
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics, stack_hands
from mjx_hand.rotations import exp

_STEPS = 60
_BATCH = 16  # hands a compiled call, so that any number of hands compiles once
_ALONG = np.linspace(0.0, 1.0, 4)  # where along each capsule's axis distances are taken
_OPENING_DAMPING = 0.01  # m/rad
# What one unit of residual is worth (m, rad).
_TOUCH, _SLIDE, _CLEAR, _SWAY, _TILT, _PLACE = 0.0005, 0.004, 0.001, 0.5, 0.3, 0.01
_INTO = 0.0003  # m: how far contacts may sink in
_BETWEEN = 0.001  # m: room between two fingers, for what a script's squeeze and a capture add


@pytree
class Posture:
    """A hand closed on an object whose centre is the origin, axes parallel to the world's.

    Attributes:
        angles: hinge angles (rad).
        rotation: world_from_hand.
        position: the wrist relative to the object's centre (m).
        touch_error: largest distance (m) of a contact from where it should be.
        contact_normal: outward normal of the object where each contact is.
        contact_jacobian: velocity (m/rad) of each contact's point on the skin by hinge.
        contact_point: that point relative to the object's centre (m).
    """

    angles: Float[Array, "*b j"]
    rotation: Float[Array, "*b 3 3"]
    position: Float[Array, "*b 3"]
    touch_error: Float[Array, "*b"]
    contact_normal: Float[Array, "*b c 3"]
    contact_jacobian: Float[Array, "*b c 3 j"]
    contact_point: Float[Array, "*b c 3"]


def solve_postures(grasp: GraspType, hands: Sequence[RigidHand], objects: Sequence[ObjectDescription]) -> Posture:
    """The posture of each hand on the object beside it (leading axis n); the objects are of one kind and one mesh."""
    kind, planes, parts = objects[0].kind, jnp.asarray(hull_planes(objects[0].hulls), jnp.float32), []
    sizes = np.stack([description.size for description in objects])
    for start in range(0, len(hands), _BATCH):
        rows = [min(start + k, len(hands) - 1) for k in range(_BATCH)]  # the last batch repeats its last hand
        batch = stack_hands([hands[k] for k in rows]), jnp.asarray(sizes[rows], jnp.float32)
        parts.append(_solve_all(grasp, kind, *batch, planes))
    return jax.tree.map(lambda *leaves: jnp.concatenate(leaves)[: len(hands)], *parts)


def squeeze_angles(closing: Pads | Wrap, posture: Posture, gains: Gains) -> Float[np.ndarray, "j"]:
    """Hinge offsets (rad) that make one posture press: dq = torque / kp.

    Pads press with balanced forces, torque = J^T f: the first contact with `closing.force` newtons, the others share
    the answer so that the sum of forces and of moments about the object's centre is least. Without that balance a
    harder squeeze makes a pinch worse.
    """
    if isinstance(closing, Wrap):
        torque = closing_torque(closing)
    else:
        inward = -np.asarray(posture.contact_normal)
        points, jacobian = np.asarray(posture.contact_point), np.asarray(posture.contact_jacobian)
        arm = np.abs(points).max()
        wrench = np.concatenate([inward, np.cross(points, inward) / arm], axis=1).T  # (6, contacts)
        shares = np.concatenate([[1.0], nnls(wrench[:, 1:], -wrench[:, 0])[0]])
        torque = np.einsum("cak,ca->k", jacobian, closing.force * shares[:, None] * inward)
    return np.clip(torque, -gains.force_limit, gains.force_limit) / gains.stiffness


def opened_angles(closing: Pads | Wrap, posture: Posture) -> Float[np.ndarray, "j"]:
    """Hinge angles (rad) before the grasp.

    Pads go `closing.opening` metres straight off their faces, by damped least squares: fingers that leave, and so
    arrive, along the face's normal touch without pushing the object aside.
    """
    if isinstance(closing, Wrap):
        return np.array(closing.opened)
    normals = np.asarray(posture.contact_normal)
    jacobian = np.asarray(posture.contact_jacobian).reshape(-1, NUM_HINGES)
    square = jacobian @ jacobian.T + _OPENING_DAMPING**2 * np.eye(len(jacobian))
    away = jacobian.T @ np.linalg.solve(square, closing.opening * normals.ravel())
    return np.asarray(posture.angles) + away


@partial(jax.jit, static_argnums=(0, 1))
def _solve_all(grasp: GraspType, kind: str, hands: RigidHand, sizes: Array, planes: Array) -> Posture:
    return jax.vmap(partial(_solve, grasp, kind), in_axes=(0, 0, None))(hands, sizes, planes)


def _solve(grasp: GraspType, kind: str, hand: RigidHand, size: Array, planes: Array) -> Posture:
    capsules = jnp.array([last_capsule(hand, LINKS.index(contact.link)) for contact in grasp.contacts])
    along = jnp.array([contact.along for contact in grasp.contacts])
    seed_angles, seed_rotation = jnp.array(grasp.posture), jnp.array(grasp.wrist_rotation)
    world_from_object = jnp.array(grasp.object_rotation)
    radius = hand.capsule_radius
    one, other = jnp.array(finger_pairs(hand)).T
    wraps = isinstance(grasp.closing, Wrap)
    faces = (jnp.zeros(0),) * 2 if wraps else _faces(grasp, kind, size, planes)
    slack = jnp.full(len(hand.capsule_links), 0.0 if wraps else 0.001).at[capsules].set(-_INTO)

    def distance(points: Array) -> Array:
        return signed_distance(kind, size, points @ world_from_object, planes)

    def axis_points(x: Array) -> Array:
        """World points on the capsules' axes, (capsules, along, 3)."""
        points = capsule_points(x[:NUM_HINGES], hand, _ALONG)
        return points @ _rotation(x, seed_rotation).T + x[-3:]

    def contacts(x: Array) -> Array:
        """World points of the contacting capsules' axes, (contacts, 3)."""
        points = axis_points(x)[capsules]
        return points[:, 0] + along[:, None] * (points[:, -1] - points[:, 0])

    def gaps(x: Array) -> tuple[Array, Array]:
        """Of each contact, how far off the surface it is, and its way (m) along the face from where it should be."""
        if wraps:
            return distance(contacts(x)) - radius[capsules] + _INTO, jnp.zeros(0)
        places, normals = faces
        target = places + normals * radius[capsules][:, None]
        gap = contacts(x) @ world_from_object - target
        towards = jnp.sum(gap * normals, axis=-1)
        return towards, (gap - towards[:, None] * normals).ravel()

    def residual(x: Array, spread: float) -> Array:
        towards, sideways = gaps(x)
        points = axis_points(x)
        clear = distance(points) - (radius + slack)[:, None]
        height = jnp.abs(world_from_object[2]) @ half_extents(kind, size)
        above = points + jnp.array([0.0, 0.0, grasp.rest]) + height * jnp.array([0.0, 0.0, 1.0])
        ground = [above[..., 2]]
        ground += [signed_distance("box", jnp.array(box.half), above - jnp.array(box.centre)) for box in grasp.support]
        ends = points[:, jnp.array([0, -1])]
        apart = axis_distance(ends[one], ends[other]) - radius[one] - radius[other] - _BETWEEN
        angles = x[:NUM_HINGES]
        outside = jnp.maximum(angles - hand.hinge_upper, 0) + jnp.maximum(hand.hinge_lower - angles, 0)
        return jnp.concatenate(
            [
                towards / _TOUCH,
                sideways / _SLIDE,
                jnp.minimum(clear, 0).ravel() / _CLEAR,
                *(jnp.minimum(g - radius[:, None] - 0.002, 0).ravel() / _CLEAR for g in ground),
                spread * jnp.minimum(apart, 0) / _CLEAR,
                (angles - seed_angles) / _SWAY,
                outside / 0.02,
                x[NUM_HINGES : NUM_HINGES + 3] / _TILT,
                out_of_place(x) / _PLACE,
            ]
        )

    def out_of_place(x: Array) -> Array:
        """How far (m) the object is from its place in the hand, along the hand's axes."""
        if not isinstance(grasp.closing, Wrap):
            return jnp.zeros(0)
        knuckle = forward_kinematics(x[:NUM_HINGES], hand)[1][LINKS.index("middle1")]
        return _rotation(x, seed_rotation).T @ -x[-3:] - knuckle - jnp.array(grasp.closing.place)

    start = jnp.concatenate([seed_angles, jnp.zeros(6)])
    # Begin with the object in its place, or the contacts' centre on the object's: the solver needs no other guess.
    centre = seed_rotation @ out_of_place(start) if wraps else -contacts(start).mean(axis=0)
    # Fingers pass through each other on their way to the object; those that stayed in each other then make room.
    x = start.at[-3:].add(centre)
    for spread in (0.0, 1.0):
        x = _levenberg_marquardt(partial(residual, spread=spread), x)
    normals = jax.vmap(jax.grad(distance))(contacts(x)) if wraps else faces[1] @ world_from_object.T

    def skin_points(angles: Array) -> Array:
        held = x.at[:NUM_HINGES].set(angles)
        return contacts(held) - normals * radius[capsules][:, None]

    angles = jnp.clip(x[:NUM_HINGES], hand.hinge_lower, hand.hinge_upper)
    return Posture(
        angles=angles,
        rotation=_rotation(x, seed_rotation),
        position=x[-3:],
        touch_error=jnp.abs(gaps(x)[0]).max(),
        contact_normal=normals,
        contact_jacobian=jax.jacfwd(skin_points)(angles),
        contact_point=skin_points(angles),
    )


def _faces(grasp: GraspType, kind: str, size: Array, planes: Array) -> tuple[Array, Array]:
    """Where each contact should be on its face, and the face's normal there, in the object's frame."""
    out = [jnp.array(contact.normal) for contact in grasp.contacts]
    aside = [jnp.array(contact.aside) for contact in grasp.contacts]
    found = [face_along(kind, size, way, past, planes) for way, past in zip(out, aside, strict=True)]
    return jnp.stack([place for place, _ in found]), jnp.stack([normal for _, normal in found])


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
