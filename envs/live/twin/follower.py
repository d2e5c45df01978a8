"""`Follower`: where the twin's hand is to be, from a tracker that loses the hand, finds it elsewhere and errs."""

import math

import numpy as np
from jaxtyping import Float

from envs.live.twin.pose import HandPose, moved, way

# How fast (m/s, rad/s, rad/s) wrist, wrist's turn and hinges may go: beyond what hands do, and after the hand was lost.
FREE = np.array([5.0, 30.0, 40.0])
GENTLE = np.array([0.3, 1.5, 2.0])
RAMP = 0.5  # s from gentle to free
COAST = 0.08  # s: how soon a hand that is lost has come to rest
_REMEMBERED = 0.04  # s over which its speed is known
_LEAP = np.array([0.15, 1.5, 3.0])  # m, rad, rad from frame to frame: no hand does that, trackers do
_PARTS = (slice(0, 3), slice(3, 6), slice(6, 26))


class Follower:
    """Targets that never jump.

    A hand that is seen is followed at once, at any speed that hands have. One that is lost coasts to rest, and is
    approached gently when it is found again, as is one that leaps.

    Attributes:
        pose: the target now.
    """

    def __init__(self, pose: HandPose):
        self.pose = pose
        self._wanted = pose
        self._speed = np.zeros(26)
        self._ease = 1.0

    def advance(self, wanted: HandPose | None, seconds: float) -> HandPose:
        """The target that much later.

        Args:
            wanted: where the tracker has the hand; None while it is not seen.
            seconds: since the last call.
        """
        if wanted is None:
            self._ease = 0.0
            self._speed *= math.exp(-seconds / COAST)
            self.pose = moved(self.pose, self._speed * seconds)
            return self.pose
        if wanted is not self._wanted and (_lengths(way(self._wanted, wanted)) > _LEAP).any():
            self._ease = 0.0
        self._wanted = wanted
        self._ease = min(1.0, self._ease + seconds / RAMP)
        most = (GENTLE + (FREE - GENTLE) * self._ease**2) * seconds
        step = way(self.pose, wanted)
        for part, length, limit in zip(_PARTS, _lengths(step), most, strict=True):
            if length > limit:
                step[part] *= limit / length
        share = min(1.0, seconds / _REMEMBERED)
        self._speed += share * (step / seconds - self._speed)
        self.pose = moved(self.pose, step)
        return self.pose


def _lengths(step: Float[np.ndarray, "26"]) -> Float[np.ndarray, "3"]:
    """Of the wrist's way, of its turn, and of the hinge that turns most."""
    return np.array([math.hypot(*step[:3]), math.hypot(*step[3:6]), np.abs(step[6:]).max()])
