"""Where the joint centres and finger tips of hands are in a scene's coordinates."""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.observation import wrist_rotation
from envs.scene import NUM_WRIST
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.body_places import model_places
from mjx_hand.bodies.human_body import body_of
from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics, stack_hands, tip_positions

Places = tuple[Float[np.ndarray, "n t links 3"], Float[np.ndarray, "n t tips 3"]]


def make_hand_places(
    hands: Sequence[RigidHand | Body], base: Float[Array | np.ndarray, "n 3 3"]
) -> Callable[[Float[Array | np.ndarray, "n t m"]], Places]:
    """A function from the hand's coordinates (m, rad) to its joint centres and finger tips (m, world).

    Args:
        hands: one for each row of coordinates, of one kind.
        base: world_from_base of each row's scene.
    """
    bodies = [body_of(hand) for hand in hands]
    rigid = [body.rigid for body in bodies if body.rigid is not None]
    if len(rigid) == len(bodies):
        stacked = stack_hands(rigid)
        return lambda coordinates: _of_people(coordinates, jnp.asarray(base), stacked)
    return lambda coordinates: _of_models(np.asarray(coordinates, float), np.asarray(base, float), bodies)


def _of_people(qpos: Float[Array | np.ndarray, "n t m"], base: Float[Array, "n 3 3"], hands: RigidHand) -> Places:
    joints, tips = _centres(jnp.asarray(qpos), base, hands)
    return np.asarray(joints), np.asarray(tips)


@jax.jit
def _centres(qpos: Float[Array, "n t m"], base: Float[Array, "n 3 3"], hands: RigidHand) -> tuple[Array, Array]:
    def one(q: Array, base: Array, hand: RigidHand) -> tuple[Array, Array]:
        rotation = wrist_rotation(q[3:NUM_WRIST], base)
        rot, pos = forward_kinematics(q[NUM_WRIST:], hand)
        tips = tip_positions(rot, pos, hand)
        return pos @ rotation.T + base @ q[:3], tips @ rotation.T + base @ q[:3]

    return jax.vmap(lambda qs, b, h: jax.lax.map(lambda q: one(q, b, h), qs, batch_size=64))(qpos, base, hands)


def _of_models(qpos: Float[np.ndarray, "n t m"], base: Float[np.ndarray, "n 3 3"], bodies: Sequence[Body]) -> Places:
    rows = [model_places(body, own) for body, own in zip(bodies, qpos, strict=True)]
    joints, tips = (np.stack(places) for places in zip(*rows, strict=True))
    return np.einsum("nij,ntkj->ntki", base, joints), np.einsum("nij,ntkj->ntki", base, tips)
