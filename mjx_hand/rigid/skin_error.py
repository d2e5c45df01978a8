"""How far the rigid links' skin lies from the blended skin of the hand they were cut from."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mjx_hand.hand.model import HandModel
from mjx_hand.hand.skinning import joint_centres, shaped_template, skin
from mjx_hand.rigid.rigid_hand import RigidHand, chain, joint_rotations
from mjx_hand.rigid.segmentation.segments import cut


def posed_skins(
    hand: HandModel, shape: ArrayLike, rigid: RigidHand, angles: Float[np.ndarray, "b 20"]
) -> tuple[Float[np.ndarray, "b v 3"], Float[np.ndarray, "b v 3"]]:
    """The hand's vertices (m, hand frame) in the same poses, on rigid links and by linear blend skinning.

    Both turn by the rigid hand's own joint rotations, so that nothing but the skin differs. Each vertex moves with the
    one link whose segment draws it.

    Args:
        hand: the hand that `rigid` was built from.
        shape: the coefficients that it was built with.
        rigid: the hand whose joints are used.
        angles: hinge angles (rad).
    """
    coefficients = np.zeros(hand.num_shape, np.float32)
    given = np.asarray(shape, np.float32).ravel()
    coefficients[: len(given)] = given
    rotations = joint_rotations(jnp.asarray(angles, jnp.float32), rigid)
    soft, _ = skin(hand, rotations, jnp.broadcast_to(coefficients, (len(angles), len(coefficients))))

    rest = shaped_template(hand, jnp.asarray(coefficients))
    owner = cut(hand).skin.vertex_links
    from_joint = np.asarray(rest - joint_centres(hand, rest)[owner])
    turn, position = (np.asarray(found) for found in chain(rotations, jnp.asarray(rigid.link_offset, jnp.float32)))
    hard = np.einsum("bvij,vj->bvi", turn[:, owner], from_joint) + position[:, owner] + rigid.wrist_position
    return np.asarray(hard, float), np.asarray(soft, float)
