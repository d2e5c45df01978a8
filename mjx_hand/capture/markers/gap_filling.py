"""Short gaps in a marker's course, filled before the fit.

By a cubic, where keypoints' gaps (`keypoint_fit.smooth`) take straight lines: markers are measured to a
fraction of a millimetre, so that their speed at a gap's ends is known; that of keypoints is mostly noise.
"""

import numpy as np
from scipy.interpolate import PchipInterpolator

from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.motion.gaps import short_gaps
from mjx_hand.pytree import replace

FILL = 0.1  # s: gaps that are filled unless something else is said


def fill_short_gaps(recording: MarkerRecording, seconds: float) -> MarkerRecording:
    """The recording with gaps of up to `seconds` filled by a cubic that does not overshoot (Fritsch and Carlson 1980).

    Longer gaps, and those at a marker's beginning or end, stay: what is unknown for long is better left to the hand's
    other markers.

    Raises:
        InputError: `seconds` is negative or not a number.
    """
    if not (np.isfinite(seconds) and seconds >= 0):
        raise InputError(f"gaps of up to {seconds} s are to be filled; expected a number of 0 or more")
    short = short_gaps(recording.visible, round(seconds * recording.fps))
    positions = np.array(recording.positions)
    for marker in np.flatnonzero(short.any(axis=0)):
        seen, gaps = (np.flatnonzero(mask[:, marker]) for mask in (recording.visible, short))
        positions[gaps, marker] = PchipInterpolator(seen, positions[seen, marker])(gaps)
    return replace(recording, positions=positions, visible=recording.visible | short)
