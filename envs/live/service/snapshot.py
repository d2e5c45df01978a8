"""`Snapshot`: the twin at one instant, as it goes out."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from envs.live.twin.contacts import Touch


@dataclass(frozen=True)
class Snapshot:
    """The twin after a physics step.

    Attributes:
        number: counts up.
        time: simulated, s.
        poses: position (m) and quaternion (wxyz) of the hand's links and of the object, world.
        angles: of the hinges (rad).
        touches: the hand's contacts with the object; empty where nobody asked for them.
        tracked: whether the tracker sees the hand.
        stepped: when the step was done, by the monotonic clock (s).
        arrived: when the frame came that this is the first to show; None if it shows none that is new.
    """

    number: int
    time: float
    poses: Float[np.ndarray, "17 7"]
    angles: Float[np.ndarray, "20"]
    touches: tuple[Touch, ...]
    tracked: bool
    stepped: float
    arrived: float | None
