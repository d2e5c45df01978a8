"""What all readers of keypoint files share: from a hand in each row of a file to a checked recording of even frames."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.at_origin import without_zeros
from mjx_hand.capture.keypoints.recording import KeypointRecording, check_keypoints
from mjx_hand.capture.timeline.timeline import Timeline


def timed_hand(
    path: Path,
    positions: Float[np.ndarray, "t 21 3"],
    timeline: Timeline,
    *,
    side: str,
    layout: str,
    source: str = "",
    warnings: tuple[str, ...] = (),
) -> KeypointRecording:
    """The recording of keypoints (m; NaN, or exactly 0, 0, 0, where missing) in rows at `timeline`'s times.

    Raises:
        InputError: they are not a well-formed recording.
    """
    return check_keypoints(
        KeypointRecording(
            fps=timeline.fps,
            positions=timeline.sampled(without_zeros(positions)),
            side=side,
            layout=layout,
            source=source or path.name,
            warnings=(*warnings, *timeline.notes),
        )
    )
