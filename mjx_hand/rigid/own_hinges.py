"""Hinges that a demonstration brings with it."""

from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.pytree import replace
from mjx_hand.rigid.rigid_hand import RigidHand


def with_hinges_of(demonstration: Demonstration, rigid: RigidHand) -> RigidHand:
    """The twin's hand: `rigid`, with the demonstration's own axes and rest rotations where it has them.

    Args:
        demonstration: whose angles belong to the hinges.
        rigid: the hand of the demonstration's shape, as `build_rigid_hand` makes it.
    """
    if demonstration.hinge_axis is None:
        return rigid
    return replace(rigid, hinge_axis=demonstration.hinge_axis, rest_rotation=demonstration.rest_rotation)
