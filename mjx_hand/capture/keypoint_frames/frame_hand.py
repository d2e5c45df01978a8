"""`FrameHand`: one hand in one frame, as a tracker gives it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class FrameHand:
    """One hand in one frame.

    Attributes:
        points: in the file's unit; NaN where a point is missing.
        names: of the points, empty where they are told by their order.
        side: "right", "left", or "" where not said, or not to be trusted.
        label: what the file calls the hand, else its place in the frame.
        unit: of the points, where the form fixes it.
        form: `WORLD` or `IMAGE` where the form says so, `LANDMARKS` where the name leaves it open, else "".
    """

    points: Float[np.ndarray, "n 3"]
    names: tuple[str, ...] = ()
    side: str = ""
    label: str = ""
    unit: str | None = None
    form: str = ""


# What MediaPipe's landmarks are: metres about the hand, shares of the picture, or either.
WORLD, IMAGE, LANDMARKS = "world", "image", "landmarks"
