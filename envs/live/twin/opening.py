"""`Opening`: which fingers of a live hand their owner opens, whose help then fades."""

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from envs.scene import NUM_WRIST
from mjx_hand.hand.joints import FINGERS, NUM_HINGES

_OPENS = 0.014  # m: a finger whose tracked tip goes so much farther from the object than it was lets go
_CLOSES = 0.01  # m: one that comes so much nearer again presses again
_TREMBLE = 0.25  # s: of the low-pass of the tips, which trackers have several millimetres off
_SOON = 0.15  # s: the time constant with which it does the one or the other
_HAND = NUM_WRIST + NUM_HINGES
_OF_FINGER = NUM_HINGES // len(FINGERS)


class Opening:
    """Watches the tracked fingers of one hand.

    What counts is how far a tracked tip, which trackers see well, is from where in the hand the object was taken; a
    thumb's joints tremble by more than it opens, and an object that slips is no finger that opens.

    Args:
        model: of a live world.

    Attributes:
        share_of_finger: how much of what helps each finger is left, from 1 to 0.
    """

    def __init__(self, model: mujoco.MjModel):
        self._model, self._tracked = model, mujoco.MjData(model)
        self._tips = [model.site(f"{finger}_tip").id for finger in FINGERS]
        self._wrist = model.body("wrist").id
        self.reset()

    def reset(self) -> None:
        """The hand is elsewhere: nothing is held."""
        self._object_in_hand = np.zeros(3)
        self._turning = np.full(len(FINGERS), np.inf)
        self._away: np.ndarray | None = None
        self._open = np.zeros(len(FINGERS), bool)
        self.share_of_finger = np.ones(len(FINGERS))

    @property
    def open(self) -> Bool[np.ndarray, "20"]:
        """Of each hinge, whether its finger is one that is opened."""
        return np.repeat(self._open, _OF_FINGER)

    @property
    def share(self) -> Float[np.ndarray, "20"]:
        """Of each hinge, how much of what helps it is left, from 1 to 0."""
        return np.repeat(self.share_of_finger, _OF_FINGER)

    def watch(self, angles: Float[np.ndarray, "20"], data: mujoco.MjData, holds: bool, seconds: float) -> None:
        """See where the tips are now.

        Args:
            angles: as tracked (rad).
            data: as the last step left it.
            holds: whether the hand holds the object, which is taken then: until it holds, where the object is counts.
            seconds: since the last call.
        """
        self._tracked.qpos[:] = data.qpos
        self._tracked.qpos[NUM_WRIST:_HAND] = angles
        mujoco.mj_kinematics(self._model, self._tracked)
        wrist, axes = self._tracked.xpos[self._wrist], self._tracked.xmat[self._wrist].reshape(3, 3)
        if not holds:
            self._object_in_hand = (data.qpos[_HAND : _HAND + 3] - wrist) @ axes
        tips = (self._tracked.site_xpos[self._tips] - wrist) @ axes
        seen = np.linalg.norm(tips - self._object_in_hand, axis=1)
        before = seen if self._away is None else self._away
        self._away = away = before + min(1.0, seconds / _TREMBLE) * (seen - before)
        # `_turning` is how near a finger was at most since it closed, or how far since it opened.
        self._turning = np.where(self._open, np.maximum(self._turning, away), np.minimum(self._turning, away))
        turned = np.where(self._open, away < self._turning - _CLOSES, away > self._turning + _OPENS)
        self._open ^= turned
        self._turning = np.where(turned, away, self._turning)
        step = min(1.0, seconds / _SOON)
        self.share_of_finger += step * (np.where(self._open, 0.0, 1.0) - self.share_of_finger)
