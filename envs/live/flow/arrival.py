"""`Arrival`: one frame of one hand, as a source hands it on."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Arrival:
    """A frame that has come in.

    Attributes:
        content: 21 keypoints (m, NaN where one is missing), or a message that says them.
        at: when it came, by the monotonic clock (s).
        spent: how long it took since to find the keypoints (s), where the source found them itself.
        again: whether a recording begins with it, anew.
    """

    content: np.ndarray | bytes | str
    at: float
    spent: float = 0.0
    again: bool = False
