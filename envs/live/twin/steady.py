"""`Steady`: a tracker's poses without their trembling, and without being late where the hand is quick.

The One Euro filter (Casiez, Roussel and Vogel 2012, https://doi.org/10.1145/2207676.2208639): a low-pass whose cutoff
grows with the speed. A hand at rest trembles with the tracker's noise, which would shake what it holds; of one that
moves nobody sees the noise, but everybody the delay.
"""

import math

import numpy as np
from jaxtyping import Float

from envs.live.twin.pose import HandPose, moved, way

_SLOWEST = 1.5  # Hz at rest
_SPEEDS = 1.0  # Hz: of the low-pass of the speeds
# Hz more by each m/s of the wrist, rad/s of its turn, rad/s of each hinge.
_QUICKER = np.concatenate([np.full(3, 25.0), np.full(3, 3.0), np.full(20, 0.6)])
_SKIPPED = 0.5  # s after which a pose follows none


class Steady:
    """Filters one hand's poses."""

    def __init__(self) -> None:
        self._pose: HandPose | None = None
        self._speed = np.zeros(26)
        self._at = 0.0

    def forget(self) -> None:
        """The next pose is taken as it is."""
        self._pose = None

    def filtered(self, pose: HandPose, at: float) -> HandPose:
        """The pose, steadied.

        Args:
            pose: as tracked.
            at: when (s).
        """
        seconds = at - self._at
        if self._pose is None or not 0 < seconds < _SKIPPED:
            self._pose, self._speed = pose, np.zeros(26)
        else:
            step = way(self._pose, pose)
            self._speed += _share(_SPEEDS, seconds) * (step / seconds - self._speed)
            # The wrist's three directions, and those of its turn, are filtered alike.
            speed = np.abs(self._speed)
            speed[:3], speed[3:6] = np.linalg.norm(self._speed[:3]), np.linalg.norm(self._speed[3:6])
            self._pose = moved(self._pose, _share(_SLOWEST + _QUICKER * speed, seconds) * step)
        self._at = at
        return self._pose


def _share(cutoff: float | Float[np.ndarray, "26"], seconds: float) -> float | Float[np.ndarray, "26"]:
    """Of the way that a low-pass of this cutoff (Hz) goes in that time."""
    return 1 / (1 + 1 / (2 * math.pi * cutoff * seconds))
