"""A hand by what `hand=` calls it."""

from mjx_hand.bodies.body import Body
from mjx_hand.bodies.human_body import HUMAN, human_body
from mjx_hand.bodies.robot_body import robot_body
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand


def named_body(hand: str) -> Body:
    """The body of a hand: "human" for that of the mean shape, a robot hand's name, or the path of its description.

    Raises:
        InputError: as `robot_body`.
    """
    return human_body(build_rigid_hand(load_hand())) if hand == HUMAN else robot_body(hand)
