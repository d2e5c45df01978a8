"""`LeftOut`: a demonstration that a robot hand cannot do, with the kind of reason, by which a set's are counted."""

import dataclasses

from envs.demonstrations.on_robot.pads import DemonstratedPads
from mjx_hand.bodies.body import Body
from mjx_hand.errors import InputError

NO_FINGERS, OUT_OF_REACH, NO_CLOSURE = "no finger for it", "out of reach", "no force closure"
REASONS = (NO_FINGERS, OUT_OF_REACH, NO_CLOSURE)


class LeftOut(InputError):
    """A demonstration that a robot cannot do.

    Attributes:
        reason: one of `REASONS`.
    """

    def __init__(self, reason: str, message: str):
        super().__init__(message)
        self.reason = reason


def shared_pads(pads: DemonstratedPads, body: Body) -> DemonstratedPads:
    """The pads of fingers that the robot has.

    Raises:
        LeftOut: fewer than two, or no thumb, which no other finger can oppose.
    """
    kept = [k for k, finger in enumerate(pads.fingers) if finger in body.fingers]
    fingers = tuple(pads.fingers[k] for k in kept)
    opposing = [finger for finger in fingers if finger in body.opposing]
    if len(fingers) < 2 or not opposing or len(opposing) == len(fingers):
        touching = ", ".join(pads.fingers) or "none"
        raise LeftOut(
            NO_FINGERS,
            f"{body.name!r} has {', '.join(body.fingers)}; of the fingers that touch ({touching}) it needs a thumb and "
            "another one",
        )
    return dataclasses.replace(
        pads,
        fingers=fingers,
        places=pads.places[:, kept],
        surface=pads.surface[kept],
        inward=pads.inward[kept],
        touching=pads.touching[:, kept],
    )
