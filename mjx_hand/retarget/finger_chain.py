"""Forward kinematics and Jacobian of the five fingers at once, each a chain of four hinges."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.hand.joints import FINGERS
from mjx_hand.projection.check import compose, turn
from mjx_hand.pytree import pytree
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.rotations import axis_angle_matrix

# Which hinges move the second joint's centre, the third's, and the tip.
_MOVES = ((0, 1), (0, 1, 2), (0, 1, 2, 3))


@pytree
class FingerChains:
    """The fingers of a rigid hand, in the order of `FINGERS`; metres and radians, wrist's frame at rest.

    Attributes:
        axis: the hinges from abduction outwards.
        base: centre of the first joint, where the first two hinges are.
        bone: from the first joint to the second, the second to the third, the third to the tip.
        rest: rotation of each joint while its hinges are at zero.
        lower, upper: limits of the hinges.
    """

    axis: Float[Array, "5 4 3"]
    base: Float[Array, "5 3"]
    bone: Float[Array, "5 3 3"]
    rest: Float[Array, "5 3 3 3"]
    lower: Float[Array, "5 4"]
    upper: Float[Array, "5 4"]


def finger_chains(rigid: RigidHand) -> FingerChains:
    """The five fingers of a hand."""
    offset = jnp.asarray(rigid.link_offset)[1:].reshape(len(FINGERS), 3, 3)
    rest = jnp.tile(jnp.eye(3), (15, 1, 1)) if rigid.rest_rotation is None else jnp.asarray(rigid.rest_rotation)
    return FingerChains(
        axis=jnp.asarray(rigid.hinge_axis).reshape(len(FINGERS), 4, 3),
        base=offset[:, 0],
        bone=jnp.concatenate([offset[:, 1:], jnp.asarray(rigid.tip_offset)[:, None]], axis=1),
        rest=rest.reshape(len(FINGERS), 3, 3, 3),
        lower=jnp.asarray(rigid.hinge_lower).reshape(len(FINGERS), 4),
        upper=jnp.asarray(rigid.hinge_upper).reshape(len(FINGERS), 4),
    )


def finger_places(
    angles: Float[Array, "*b 5 4"], chains: FingerChains
) -> tuple[Float[Array, "*b 5 3 3"], Float[Array, "*b 5 3 4 3"]]:
    """Second joint, third joint and tip of each finger (m, wrist's frame), and how they move with each angle (m/rad).

    A place moves with a hinge as the hinge's axis x the lever from the hinge to the place.
    """
    turns = axis_angle_matrix(chains.axis, angles)
    rotation, centre = turns[..., 0, :, :], jnp.broadcast_to(chains.base, (*angles.shape[:-1], 3))
    axes, centres, places = [jnp.broadcast_to(chains.axis[:, 0], centre.shape)], [centre], []
    for k in (1, 2, 3):
        axes.append(turn(rotation, chains.axis[:, k]))
        centres.append(centre)
        rotation = compose(compose(rotation, turns[..., k, :, :]), chains.rest[:, k - 1])
        centre = centre + turn(rotation, chains.bone[:, k - 1])
        places.append(centre)
    still = jnp.zeros_like(centre)
    slopes = [
        jnp.stack([jnp.cross(axes[h], place - centres[h]) if h in moves else still for h in range(4)], axis=-2)
        for place, moves in zip(places, _MOVES, strict=True)
    ]
    return jnp.stack(places, axis=-2), jnp.stack(slopes, axis=-3)


def by_finger(angles: Float[Array | np.ndarray, "*b 20"]) -> Float[Array, "*b 5 4"]:
    """Hinge angles in the order of `HINGES`, finger by finger."""
    return jnp.asarray(angles).reshape(*angles.shape[:-1], len(FINGERS), 4)
