"""Sights of a marker that leaps away and back: for a moment its label was another marker's, or a reflection's."""

import itertools

import numpy as np
from jaxtyping import Bool, Float

Array = np.ndarray
# How much further (m) a marker goes in one frame than in the frames around it, the hand's own movement apart, when it
# leaps. Fingers do not start that suddenly: at 100 frames/s it is 150 times the acceleration of gravity.
LEAP = 0.015
RETURN = 0.7  # share of the leap by which the leap back may miss its beginning
LONGEST = 1.0  # s; after more the hand has moved on, and there is no saying which label was right
AROUND = (-2, -1, 1, 2)  # the steps that a step is compared with


def excursions(
    positions: Float[Array, "t m 3"], visible: Bool[Array, "t m"], fps: float, leap: float = LEAP
) -> Bool[Array, "t m"]:
    """The sights between a leap and the leap back, of one frame or of up to a second.

    Args:
        positions: of the markers (m), anything where one is not visible.
        visible: whether it was seen.
        fps: frames per second.
        leap: the least leap, m.
    """
    away = np.zeros(visible.shape, bool)
    if len(positions) < 3:
        return away
    sudden = sudden_steps(positions, visible)
    far = np.linalg.norm(sudden, axis=2) > leap
    longest = max(round(LONGEST * fps), 1)
    for marker in np.flatnonzero(far.any(axis=0)):
        steps = np.flatnonzero(far[:, marker])
        last = -1  # frame at which the excursion before this ended
        for out, back in itertools.pairwise(steps):
            there, here = sudden[out, marker], sudden[back, marker]
            returns = np.linalg.norm(there + here) < RETURN * np.linalg.norm(there)
            if returns and out != last and back - out <= longest:
                away[out + 1 : back + 1, marker] = True
                last = back
    return away & visible


def sudden_steps(positions: Float[Array, "t m 3"], visible: Bool[Array, "t m"]) -> Float[Array, "s m 3"]:
    """Each step from frame to frame, less the markers' common one and less the marker's own steps around it (m).

    Zero where the marker is not seen before and after.
    """
    known = visible[1:] & visible[:-1]
    steps = np.where(known[..., None], positions[1:] - positions[:-1], np.nan)
    steps -= middle(steps, axis=1)[:, None]
    padded = np.pad(steps, ((2, 2), (0, 0), (0, 0)), constant_values=np.nan)
    around = np.stack([padded[2 + k : 2 + k + len(steps)] for k in AROUND])
    return np.nan_to_num(steps - np.nan_to_num(middle(around, axis=0)))


def middle(values: Float[Array, "*a"], axis: int) -> Float[Array, "*b"]:
    """The median of what is not NaN; NaN where nothing is."""
    ordered = np.sort(values, axis=axis)  # NaN go last
    count = np.isfinite(values).sum(axis=axis, keepdims=True)
    at = (np.maximum(count - 1, 0) // 2, np.minimum(count // 2, values.shape[axis] - 1))
    low, high = (np.take_along_axis(ordered, k, axis) for k in at)
    return np.squeeze((low + high) / 2, axis)
