"""The path towards an object that is seen elsewhere than demonstrated, of a set's demonstrations."""

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from envs.reference import Reference
from mjx_hand.player.approach import followed


def followed_target(
    reference: Reference,
    demonstration: Int[Array, ""],
    frame: Int[Array, ""],
    displacement: Float[Array, "3"],
) -> Float[Array, "u"]:
    """What is added to the demonstrated targets (m, rad) at a frame (`mjx_hand.player.approach`).

    Args:
        reference: the demonstrations.
        demonstration, frame: of them.
        displacement: of the object at first: x, y (m) and the turn about the vertical (rad).
    """
    return followed(
        reference.targets[demonstration, frame],
        reference.base[demonstration],
        reference.object_pose[demonstration, 0, :3],
        displacement * reference.approach[demonstration, frame],
        jnp,
    )
