"""Shape, joints and linear blend skinning of a MANO-layout hand (Romero et al. 2017, eq. 2-6; paper eq. 1)."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_hand.hand.joints import PARENTS
from mjx_hand.hand.model import HandModel


def shaped_template(hand: HandModel, shape: Float[Array, "*b s"]) -> Float[Array, "*b v 3"]:
    """Rest vertices (m) for shape coefficients; fewer coefficients than the hand has are zero-padded."""
    directions = jnp.asarray(hand.shapedirs)[..., : shape.shape[-1]]
    return jnp.asarray(hand.template) + jnp.einsum("vcs,...s->...vc", directions, shape)


def joint_centres(hand: HandModel, rest_vertices: Float[Array, "*b v 3"]) -> Float[Array, "*b 16 3"]:
    """Joint centres (m, hand frame) regressed from rest vertices."""
    return jnp.einsum("jv,...vc->...jc", jnp.asarray(hand.joint_regressor), rest_vertices)


def link_transforms(
    rotations: Float[Array, "*b 15 3 3"], centres: Float[Array, "*b 16 3"]
) -> tuple[Float[Array, "*b 16 3 3"], Float[Array, "*b 16 3"]]:
    """Forward kinematics of the 15 ball joints, the wrist held at its rest pose.

    Args:
        rotations: each joint's rotation relative to its parent, in axes parallel to the hand frame at rest.
        centres: rest joint centres (m).

    Returns:
        Each link's rotation and its joint's position (m), in the hand frame.
    """
    rot = [jnp.broadcast_to(jnp.eye(3, dtype=rotations.dtype), (*rotations.shape[:-3], 3, 3))]
    pos = [jnp.broadcast_to(centres[..., 0, :], (*rotations.shape[:-3], 3))]
    for j, parent in enumerate(PARENTS[1:], start=1):
        offset = centres[..., j, :] - centres[..., parent, :]
        rot.append(rot[parent] @ rotations[..., j - 1, :, :])
        pos.append(pos[parent] + jnp.einsum("...ij,...j->...i", rot[parent], offset))
    return jnp.stack(rot, axis=-3), jnp.stack(pos, axis=-2)


def skin(
    hand: HandModel, rotations: Float[Array, "*b 15 3 3"], shape: Float[Array, "*b s"]
) -> tuple[Float[Array, "*b v 3"], Float[Array, "*b 16 3"]]:
    """Vertices and joint centres (m, hand frame) of the posed hand, the wrist at its rest pose.

    Pose correctives (`posedirs`) are included, as in MANO.
    """
    rest = shaped_template(hand, shape)
    centres = joint_centres(hand, rest)
    feature = (rotations - jnp.eye(3)).reshape(*rotations.shape[:-3], 135)
    corrected = rest + jnp.einsum("vcp,...p->...vc", jnp.asarray(hand.posedirs), feature)
    rot, pos = link_transforms(rotations, centres)
    # A vertex moves with each link as R_j (v - c_j) + p_j: fold -R_j c_j + p_j into one offset a link.
    offset = pos - jnp.einsum("...jab,...jb->...ja", rot, jnp.broadcast_to(centres, pos.shape))
    weights = jnp.asarray(hand.weights)
    blended = jnp.einsum("vj,...jab->...vab", weights, rot)
    vertices = jnp.einsum("...vab,...vb->...va", blended, corrected) + jnp.einsum("vj,...ja->...va", weights, offset)
    return vertices, pos
