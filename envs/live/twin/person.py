"""`Person`: the hand of whoever is in front of the tracker, measured in the first seconds."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.bone_lengths import median_lengths, shape_of_lengths
from mjx_hand.capture.keypoints.layouts import NUM_KEYPOINTS
from mjx_hand.capture.keypoints.size import check_size
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand

FRAMES, SECONDS = 30, 1.5  # whole frames, over at least that time
_MOST = 600  # frames; who holds still for longer is known


class KnownHand(NamedTuple):
    """A person's hand.

    Attributes:
        rigid: the hand.
        shape: coefficients that it was built from.
    """

    rigid: RigidHand
    shape: Float[np.ndarray, "s"]


class Person:
    """Gathers frames until they say the hand's shape.

    Args:
        side: of the hand.
    """

    def __init__(self, side: str):
        self._side = side
        self._frames: list[np.ndarray] = []
        self._began: float | None = None

    def add(self, keypoints: Float[np.ndarray, "21 3"], at: float) -> float:
        """One more frame, and when it came (s); how much is known, 0 to 1. Frames without the whole hand do not count.

        A device may have no wrist: the first keypoint may be missing.
        """
        if np.isfinite(keypoints[1:NUM_KEYPOINTS]).all() and len(self._frames) < _MOST:
            self._began = at if self._began is None else self._began
            self._frames.append(keypoints)
        if self._began is None:
            return 0.0
        return min(len(self._frames) / FRAMES, (at - self._began) / SECONDS, 1.0)

    def hand(self) -> KnownHand:
        """The person's hand.

        Raises:
            InputError: it is no hand's size.
        """
        return measured_hand(np.stack(self._frames), self._side)


def measured_hand(keypoints: Float[np.ndarray, "t 21 3"], side: str) -> KnownHand:
    """The hand that has these bones, by their medians.

    Args:
        keypoints: of frames that show the whole hand (m).
        side: of the hand.

    Raises:
        InputError: it is no hand's size.
    """
    model, observed = load_hand(side=side), median_lengths(keypoints)
    check_size("hand", model, observed)
    shape = shape_of_lengths(model, observed)
    return KnownHand(build_rigid_hand(model, shape), shape)
