"""A hand and an object over time, in a world with z up, at any rate."""

import dataclasses

import numpy as np
from jaxtyping import Float

from mjx_hand.motion.resample import interpolation_index, matrix_quaternions, quaternion_matrices, slerp
from mjx_hand.motion.smooth import smooth_rows


@dataclasses.dataclass(frozen=True)
class ObservedSequence:
    """Hand and object, z up and the table at z = 0; metres, radians, seconds."""

    times: Float[np.ndarray, "t"]
    angles: Float[np.ndarray, "t 20"]
    hand_rotation: Float[np.ndarray, "t 3 3"]
    hand_position: Float[np.ndarray, "t 3"]
    rotation: Float[np.ndarray, "t 3 3"]
    position: Float[np.ndarray, "t 3"]


def resampled(observed: ObservedSequence, begin: float, rate: float, cutoff: float) -> ObservedSequence:
    """From `begin` (s) on, at another rate (frames/s), filtered (Hz)."""
    times = np.arange(begin, observed.times[-1] + 1e-6, 1 / rate)
    before, after, fraction = interpolation_index(observed.times, times)

    def line(rows: np.ndarray) -> np.ndarray:
        between = (1 - fraction[:, None]) * rows[before] + fraction[:, None] * rows[after]
        return smooth_rows(between, rate, cutoff)

    def arc(rotation: np.ndarray) -> np.ndarray:
        rows = matrix_quaternions(slerp(rotation[before], rotation[after], fraction))
        rows = smooth_rows(rows, rate, cutoff)
        return quaternion_matrices(rows / np.linalg.norm(rows, axis=1, keepdims=True))

    return ObservedSequence(
        times=times,
        angles=line(observed.angles),
        hand_rotation=arc(observed.hand_rotation),
        hand_position=line(observed.hand_position),
        rotation=arc(observed.rotation),
        position=line(observed.position),
    )
