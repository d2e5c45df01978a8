"""Hinge angles moved until finger tips and joint centres are where the recording has them.

Projection makes each joint's rotation as near as it can be; what is left adds up along a finger, and the tip is off by
millimetres. Here each finger's four angles are moved by a damped Gauss-Newton iteration (Levenberg 1944, Marquardt
1963) from the projected angles, which they stay near, within the limits. The wrist is held, so that the five fingers
are five small systems, and frames are independent.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.hand.joints import FINGERS, NUM_HINGES
from mjx_hand.pytree import pytree
from mjx_hand.retarget.finger_chain import FingerChains, by_finger, finger_chains, finger_places
from mjx_hand.retarget.small_systems import solve_positive
from mjx_hand.rigid.rigid_hand import RigidHand, chain, tip_positions

ITERATIONS = 5  # further ones move tips by less than 0.01 mm
_FIRST_DAMPING = 1e-2  # of the diagonal
_AT_LIMIT = 1e-6  # rad


@pytree
class RefineWeights:
    """What counts how much against a metre at the finger tip.

    Attributes:
        joint: a metre at the second or third joint's centre.
        angle: a radian away from the angles that it began with, in metres. Small: it settles what the places leave
            open.
    """

    joint: float = 0.2
    angle: float = 0.002


def recorded_places(rotations: Float[Array | np.ndarray, "*b 15 3 3"], rigid: RigidHand) -> Float[Array, "*b 5 3 3"]:
    """Where a recording has each finger's second joint, third joint and tip (m, wrist's frame), with `rigid`'s bones.

    Args:
        rotations: relative rotations of the 15 joints, which the hinges need not be able to follow.
        rigid: the hand.
    """
    rotation, position = chain(jnp.asarray(rotations), jnp.asarray(rigid.link_offset))
    joints = position[..., 1:, :].reshape(*position.shape[:-2], len(FINGERS), 3, 3)[..., 1:, :]
    return jnp.concatenate([joints, tip_positions(rotation, position, rigid)[..., None, :]], axis=-2)


def refine_angles(
    angles: Float[Array | np.ndarray, "*b 20"],
    places: Float[Array | np.ndarray, "*b 5 3 3"],
    rigid: RigidHand,
    contact: Float[Array | np.ndarray, "*b 5 3"] | None = None,
    weights: RefineWeights | None = None,
) -> Float[Array, "*b 20"]:
    """Angles (rad) near `angles`, within the hand's limits, that bring joint centres and tips to `places`.

    Minimises, finger by finger, |tip - its place|² + joint² Σ |centre - its place|² + angle² |change of the angles|²
    + (contact · (tip - its place))². Can be jitted and vmapped. No step is taken that makes it worse.

    Args:
        angles: where to start and what to stay near, such as the projection's answer; brought within the limits first.
        places: as of `recorded_places`.
        rigid: the hand.
        contact: for each tip a surface's normal in the wrist's frame, as long as a metre along it is to count besides;
            zero where nothing is touched. See `mjx_hand.retarget.contacts`.
        weights: `RefineWeights()` if None.
    """
    angles, places = jnp.asarray(angles), jnp.asarray(places)
    touched = jnp.zeros_like(places[..., 2, :]) if contact is None else jnp.asarray(contact, places.dtype)
    refined = _refine(by_finger(angles), places, touched, finger_chains(rigid), weights or RefineWeights())
    return refined.reshape(*angles.shape[:-1], NUM_HINGES)


@jax.jit
def _refine(
    angles: Float[Array, "*b 5 4"],
    places: Float[Array, "*b 5 3 3"],
    contact: Float[Array, "*b 5 3"],
    chains: FingerChains,
    weights: RefineWeights,
) -> Float[Array, "*b 5 4"]:
    # A loop of its own: four unknowns within limits, millions of systems at once, solved without a call for each.
    start = jnp.clip(angles, chains.lower, chains.upper)
    sizes = jnp.array([weights.joint, weights.joint, 1.0], start.dtype)[:, None]

    def linearised(angles: Array) -> tuple[Array, Array, Array]:
        """Half the objective, its gradient and Gauss-Newton's matrix."""
        reached, slope = finger_places(angles, chains)
        off = (reached - places) * sizes
        slope = slope * sizes[..., None]
        along = jnp.sum(contact * (reached - places)[..., 2, :], axis=-1)
        along_slope = jnp.sum(contact[..., None, :] * slope[..., 2, :, :], axis=-1)
        away = weights.angle * (angles - start)
        cost = jnp.sum(off**2, axis=(-2, -1)) + along**2 + jnp.sum(away**2, axis=-1)
        # As sums of products, which fuse; a matrix product of this size is a call a system.
        gradient = jnp.sum(slope * off[..., None, :], axis=(-3, -1)) + along_slope * along[..., None]
        gradient += weights.angle * away
        matrix = jnp.sum(slope[..., :, None, :] * slope[..., None, :, :], axis=(-4, -1))
        matrix += along_slope[..., :, None] * along_slope[..., None, :] + weights.angle**2 * jnp.eye(4)
        return cost / 2, gradient, matrix

    def step(_: Array, state: tuple) -> tuple:
        angles, damping, cost, gradient, matrix = state
        # An angle at its limit that would go further is held: its row and column leave the system.
        held = ((angles <= chains.lower + _AT_LIMIT) & (gradient > 0)) | (
            (angles >= chains.upper - _AT_LIMIT) & (gradient < 0)
        )
        free = 1.0 - held
        diagonal = jnp.diagonal(matrix, axis1=-2, axis2=-1)
        system = matrix * free[..., :, None] * free[..., None, :]
        system += (held + damping[..., None] * diagonal)[..., None] * jnp.eye(4)
        tried = jnp.clip(angles - solve_positive(system, gradient * free), chains.lower, chains.upper)
        new = linearised(tried)
        better = new[0] < cost

        def kept(new: Array, old: Array) -> Array:
            return jnp.where(better.reshape(better.shape + (1,) * (new.ndim - better.ndim)), new, old)

        damping = jnp.clip(jnp.where(better, damping / 10, damping * 10), 1e-6, 1e3)
        return kept(tried, angles), damping, *(kept(a, b) for a, b in zip(new, (cost, gradient, matrix), strict=True))

    first = (start, jnp.full(start.shape[:-1], _FIRST_DAMPING, start.dtype), *linearised(start))
    return jax.lax.fori_loop(0, ITERATIONS, step, first)[0]
