"""The wrist's path towards an object that is seen elsewhere than demonstrated (`mjx_hand.player.approach`)."""

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from envs.reference import Reference
from envs.scene import NUM_WRIST
from mjx_hand.player.approach import moved_wrist


def followed(
    reference: Reference,
    demonstration: Int[Array, ""],
    frame: Int[Array, ""],
    displacement: Float[Array, "3"],
) -> Float[Array, "u"]:
    """What is added to the demonstrated targets (m, rad) at a frame; nothing to the hand's joints.

    Args:
        reference: the demonstrations.
        demonstration, frame: of them.
        displacement: of the object at first: x, y (m) and the turn about the vertical (rad).
    """
    target = reference.targets[demonstration, frame]
    wrist = moved_wrist(
        target[:NUM_WRIST],
        reference.base[demonstration],
        reference.object_pose[demonstration, 0, :3],
        displacement * reference.approach[demonstration, frame],
        jnp,
    )
    return jnp.zeros_like(target).at[:NUM_WRIST].set(wrist)
