"""The rigid human hand as a `Body`."""

from collections.abc import Sequence

from mjx_hand.bodies.body import Body, ContactGeom
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, HINGES, LINKS
from mjx_hand.rigid.export.mjcf import capsule_names, hand_spec
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand

HUMAN = "human"
HUMAN_PALM = (LINKS.index("wrist"), LINKS.index("index1"), LINKS.index("pinky1"))


def human_body(rigid: RigidHand) -> Body:
    """A person's hand with the gains of a human one."""
    contacts = [
        ContactGeom(name, LINKS[link], LINKS[link].rstrip("123") if link else "")
        for name, link in zip(capsule_names(rigid), rigid.capsule_links, strict=True)
    ]
    return Body(
        name=HUMAN,
        side=rigid.side,
        fingers=FINGERS,
        opposing=("thumb",),
        joints=HINGES,
        coupled=(),
        tree_joints=HINGES,
        links=LINKS,
        palm=HUMAN_PALM,
        contacts=tuple(contacts),
        gains=Gains(),
        build=lambda gains, visual: hand_spec(rigid, base="actuated", visual=visual, gains=gains),
        rigid=rigid,
    )


def body_of(hand: RigidHand | Body) -> Body:
    """A person's hand as the body that it is; a body as it is."""
    return hand if isinstance(hand, Body) else human_body(hand)


def check_one_kind(hands: Sequence[RigidHand | Body]) -> Body:
    """The first of these hands, if all are of one kind and commanded alike.

    Raises:
        InputError: they are not.
    """
    bodies = [body_of(hand) for hand in hands]
    for k, body in enumerate(bodies):
        if (body.name, body.names) != (bodies[0].name, bodies[0].names):
            raise InputError(
                f"hand {k} is {body.name!r} with {len(body.joints)} actuated joints, hand 0 {bodies[0].name!r} with "
                f"{len(bodies[0].joints)}; an environment runs hands of one kind"
            )
    return bodies[0]
