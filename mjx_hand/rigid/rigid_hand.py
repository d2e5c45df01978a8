"""`RigidHand`: 16 rigid links, 20 hinges, and their forward kinematics."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.hand.joints import HINGE_LINKS, NUM_HINGES, PARENTS, TIP_LINKS
from mjx_hand.pytree import pytree, replace, static
from mjx_hand.rotations import axis_angle_matrix


@pytree
class RigidHand:
    """A hand of 16 rigid links joined by 20 hinges (arXiv 2512.07359, section III).

    Lengths metres, masses kilograms, angles radians. Every link frame sits at its joint's centre and
    is parallel to the hand frame in the flat hand, so that a link's rotation relative to its parent *is* the
    MANO rotation of that joint and hinge axes are given in hand-frame directions. Links and fingers
    are in the order of `hand.joints.LINKS` and `FINGERS`, hinges in that of `hand.joints.HINGES`.

    Attributes:
        wrist_position: the wrist joint in the hand frame; the first link's frame origin.
        link_offset: each link's joint centre relative to its parent's (row 0 is zero).
        hinge_axis: unit axes. A base joint turns as R = R(abduction) R(flexion); positive is flexion.
        hinge_lower, hinge_upper: hard limits.
        soft_lower, soft_upper: soft limits within them, where a controller should begin to give way, or None.
        rest_rotation: each joint's rotation while its hinges are at zero, R = R(hinges) rest_rotation, for a person
            whose hinges do not pass through the flat hand; None is the identity. It is free of turns about the
            joint's own axes, so that angles and limits are counted from the flat hand all the same.
        tip_offset: finger tips relative to the distal link's frame.
        link_mass, link_com, link_inertia: mass, centre of mass in the link frame, and inertia tensor
            about it (kg m^2, axes of the link frame).
        capsule_ends: the two segment ends of each collision capsule, in its link's frame.
        capsule_radius: their radii.
        capsule_links: the link each capsule belongs to.
        mesh_vertices, mesh_faces: each link's closed surface, in its link frame.
        side: "right" or "left".
        name: for reports and file names.
    """

    wrist_position: Float[np.ndarray | Array, "3"]
    link_offset: Float[np.ndarray | Array, "16 3"]
    hinge_axis: Float[np.ndarray | Array, "20 3"]
    hinge_lower: Float[np.ndarray | Array, "20"]
    hinge_upper: Float[np.ndarray | Array, "20"]
    tip_offset: Float[np.ndarray | Array, "5 3"]
    link_mass: Float[np.ndarray | Array, "16"]
    link_com: Float[np.ndarray | Array, "16 3"]
    link_inertia: Float[np.ndarray | Array, "16 3 3"]
    capsule_ends: Float[np.ndarray | Array, "c 2 3"]
    capsule_radius: Float[np.ndarray | Array, "c"]
    mesh_vertices: tuple[np.ndarray, ...]
    mesh_faces: tuple[np.ndarray, ...]
    capsule_links: tuple[int, ...] = static()
    rest_rotation: Float[np.ndarray | Array, "15 3 3"] | None = None
    soft_lower: Float[np.ndarray | Array, "20"] | None = None
    soft_upper: Float[np.ndarray | Array, "20"] | None = None
    side: str = static()
    name: str = static()


def joint_rotations(angles: Float[Array | np.ndarray, "*b 20"], rigid: RigidHand) -> Float[Array, "*b 15 3 3"]:
    """Rotations of the 15 MANO joints that the 20 hinge angles (rad) produce.

    The inverse of `project` on the rotations that the hinges can reach.
    """
    hinge = axis_angle_matrix(jnp.asarray(rigid.hinge_axis), jnp.asarray(angles))  # (*b, 20, 3, 3)
    out = []
    for link in range(1, 16):
        mine = [h for h in range(NUM_HINGES) if HINGE_LINKS[h] == link]
        first = hinge[..., mine[0], :, :]
        out.append(first @ hinge[..., mine[1], :, :] if len(mine) == 2 else first)
    turned = jnp.stack(out, axis=-3)
    return turned if rigid.rest_rotation is None else turned @ jnp.asarray(rigid.rest_rotation, turned.dtype)


def axes_in_links(rigid: RigidHand) -> Float[np.ndarray, "20 3"]:
    """Unit hinge axes in the frame of the link that each moves, as it lies with all hinges at zero.

    They differ from `hinge_axis` by the rest rotation: R_a R0 = R0 R_b for b = R0ᵀ a.
    """
    axis = np.asarray(rigid.hinge_axis, dtype=float)
    if rigid.rest_rotation is None:
        return axis
    rest = np.asarray(rigid.rest_rotation, dtype=float)[np.array(HINGE_LINKS) - 1]
    return np.einsum("hji,hj->hi", rest, axis)


def forward_kinematics(
    angles: Float[Array | np.ndarray, "*b 20"], rigid: RigidHand
) -> tuple[Float[Array, "*b 16 3 3"], Float[Array, "*b 16 3"]]:
    """Link rotations and positions (m) in the wrist's frame: its origin is the wrist joint."""
    rotations = joint_rotations(angles, rigid)
    return chain(rotations, jnp.asarray(rigid.link_offset))


def chain(
    rotations: Float[Array, "*b 15 3 3"], link_offset: Float[Array, "16 3"]
) -> tuple[Float[Array, "*b 16 3 3"], Float[Array, "*b 16 3"]]:
    """Link rotations and positions (m), wrist-relative, from the 15 relative rotations."""
    batch = rotations.shape[:-3]
    rot = [jnp.broadcast_to(jnp.eye(3, dtype=rotations.dtype), (*batch, 3, 3))]
    pos = [jnp.zeros((*batch, 3), rotations.dtype)]
    for link, parent in enumerate(PARENTS[1:], start=1):
        rot.append(rot[parent] @ rotations[..., link - 1, :, :])
        pos.append(pos[parent] + rot[parent] @ link_offset[link])
    return jnp.stack(rot, axis=-3), jnp.stack(pos, axis=-2)


def finger_tips(angles: Float[Array | np.ndarray, "*b 20"], rigid: RigidHand) -> Float[Array, "*b 5 3"]:
    """Finger-tip positions (m) in the wrist's frame."""
    return tip_positions(*forward_kinematics(angles, rigid), rigid)


def tip_positions(
    link_rotation: Float[Array, "*b 16 3 3"], link_position: Float[Array, "*b 16 3"], rigid: RigidHand
) -> Float[Array, "*b 5 3"]:
    """Finger-tip positions (m) of links that stand at these rotations and positions."""
    tips = list(TIP_LINKS)
    reach = jnp.einsum("...fij,fj->...fi", link_rotation[..., tips, :, :], jnp.asarray(rigid.tip_offset))
    return link_position[..., tips, :] + reach


def without_meshes(rigid: RigidHand) -> RigidHand:
    """The hand without what only pictures need, so that it passes into compiled functions at no cost."""
    return replace(rigid, mesh_vertices=(), mesh_faces=())


def on_device(rigid: RigidHand) -> RigidHand:
    """The hand as JAX's own arrays, without its meshes: compiled functions may take it or close over it."""
    return jax.tree.map(jnp.asarray, without_meshes(rigid))


def stack_hands(hands: Sequence[RigidHand]) -> RigidHand:
    """Hands of one structure as one `RigidHand` with a leading axis, to `vmap` over; float32, without their meshes."""
    first = hands[0]
    bare = [replace(without_meshes(h), name=first.name) for h in hands]
    return jax.tree.map(lambda *rows: jnp.asarray(np.stack(rows), jnp.float32), *bare)
