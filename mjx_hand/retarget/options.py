"""What a retargeting can be told."""

import dataclasses

from mjx_hand.errors import InputError
from mjx_hand.projection import METHODS

REFINEMENTS = ("none", "tips")


@dataclasses.dataclass(frozen=True)
class RetargetOptions:
    """How recorded rotations become hinge angles.

    Attributes:
        method: a name in `projection.METHODS`.
        carry: give what a joint's hinges could not follow to the next joint of its finger.
        limits: stay within the hand's limits.
        refine: "tips" moves the angles until finger tips and joint centres are where the recording has them, within
            the limits; "none" leaves the projection as it is.
        smooth: cut-off of a low-pass filter over time, Hz; None for none.

    Raises:
        InputError: an unknown name, or a cut-off that is not positive.
    """

    method: str = "exact"
    carry: bool = False
    limits: bool = False
    refine: str = "none"
    smooth: float | None = None

    def __post_init__(self):
        if self.method not in METHODS:
            raise InputError(f"method {self.method!r} is unknown: choose one of {', '.join(METHODS)}")
        if self.refine not in REFINEMENTS:
            raise InputError(f"refine is {self.refine!r}: choose one of {', '.join(REFINEMENTS)}")
        if self.smooth is not None and not self.smooth > 0:
            raise InputError(f"smooth is {self.smooth} Hz: give a positive cut-off, or leave it out")
