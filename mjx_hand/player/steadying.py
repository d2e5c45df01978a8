"""The fingers of a hand that is led live: followed at once while they are free, steadied while they hold.

A tracker's trembling shakes out what a hand holds; a finger that reaches must not be late. So the joints of a hand that
holds are low-passed, and what that is behind by when it lets go is made up for, not jumped. Arrays of NumPy and of JAX
are both taken: `xp` is the module that they belong to.
"""

from typing import Any

from mjx_hand.hand.joints import FINGERS

_STEADY = 0.8  # s: of the low-pass
_SOON = 0.15  # s over which what it was behind by is made up for
_TOUCHES = 0.05  # N
_THUMB = FINGERS.index("thumb")
_FIST = 3  # fingers besides the thumb that hold without it, against the palm


def holding(forces: Any, xp: Any) -> Any:
    """Whether links that press so hold something between them: thumb and a finger, or three fingers.

    Args:
        forces: (16, 3) what each link presses the object with (N), in the order of `hand.joints.LINKS`.
        xp: numpy or jax.numpy.
    """
    touches = (xp.sum(forces[1:] ** 2, axis=-1) > _TOUCHES**2).reshape(len(FINGERS), -1).any(axis=1)
    others = touches.sum() - touches[_THUMB]
    return (touches[_THUMB] & (others > 0)) | (others >= _FIST)


def steadied(before: Any, tracked_before: Any, tracked: Any, holds: Any, seconds: float, xp: Any) -> Any:
    """Joints (rad) to follow in place of tracked ones.

    Args:
        before: of the last call.
        tracked_before, tracked: joints as tracked, then and now.
        holds: whether the hand holds something.
        seconds: since the last call.
        xp: numpy or jax.numpy.
    """
    slow = before + min(1.0, seconds / _STEADY) * (tracked - before)
    free = tracked + (1.0 - min(1.0, seconds / _SOON)) * (before - tracked_before)
    return xp.where(holds, slow, free)
