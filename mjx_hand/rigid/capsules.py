"""A hand's collision capsules as points: where they are in a posture, and which of them a link ends in."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics


def capsule_points(
    angles: Float[Array | np.ndarray, "20"], rigid: RigidHand, along: Float[np.ndarray, "n"]
) -> Float[Array, "c n 3"]:
    """Points (m, in the wrist's frame) on the axes of all capsules, at shares `along` of each from end to end."""
    rot, pos = forward_kinematics(angles, rigid)
    links = jnp.array(rigid.capsule_links)
    ends = pos[links][:, None] + jnp.einsum("cij,cej->cei", rot[links], jnp.asarray(rigid.capsule_ends))
    return ends[:, :1] + along[None, :, None] * (ends[:, 1:] - ends[:, :1])


def last_capsule(rigid: RigidHand, link: int) -> int:
    """The number of a link's last capsule."""
    return max(k for k, owner in enumerate(rigid.capsule_links) if owner == link)
