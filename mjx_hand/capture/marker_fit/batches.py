"""Any number of frames through one compiled solver: chunks of a fixed size, the last one padded."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from mjx_hand.capture.marker_fit.linearise import PoseState
from mjx_hand.capture.marker_fit.pose_solver import Frames, PoseEstimate, solve_poses
from mjx_hand.capture.marker_fit.skinned_points import SkinnedPoints
from mjx_hand.pytree import replace

CHUNK = 256  # frames per call
BY_FRAME = ("observed", "weight", "rest", "centres", "mean")  # what of `Frames` has one row per frame
Array = np.ndarray


def padded(frames: Frames, state: PoseState, size: int) -> tuple[Frames, PoseState]:
    """Frames and poses with the last frame repeated up to `size`, the repeats without markers."""
    count = frames.observed.shape[0]

    def pad(array: Array) -> Array:
        return np.concatenate([array, np.repeat(array[-1:], size - count, axis=0)])

    weight = np.concatenate([frames.weight, np.zeros((size - count, frames.weight.shape[1]), np.float32)])
    longer = replace(
        frames, weight=weight, **{name: pad(getattr(frames, name)) for name in BY_FRAME if name != "weight"}
    )
    return longer, jax.tree.map(pad, state)


def part(frames: Frames, state: PoseState, at: slice | Array) -> tuple[Frames, PoseState]:
    """Some of the frames and their poses."""
    some = replace(frames, **{name: getattr(frames, name)[at] for name in BY_FRAME})
    return some, jax.tree.map(lambda array: array[at], state)


class Meter:
    """How much of a known amount of work is done, told to a listener."""

    def __init__(self, listener: Callable[[float], None] | None, total: int) -> None:
        self._listener, self._total, self._done = listener, total, 0

    def add(self, amount: int) -> None:
        """Count work as done and tell the listener the share, from 0 to 1."""
        self._done += amount
        if self._listener is not None:
            self._listener(min(self._done / self._total, 1.0))


def solve_all(points: SkinnedPoints, frames: Frames, state: PoseState, iterations: int, meter: Meter) -> PoseEstimate:
    """`solve_poses` on NumPy arrays of any length; a frame counts `iterations` on the meter."""
    found = []
    for start in range(0, frames.observed.shape[0], CHUNK):
        some, begin = part(frames, state, slice(start, start + CHUNK))
        count = some.observed.shape[0]
        chunk = jax.tree.map(jnp.asarray, padded(some, begin, CHUNK))
        estimate = solve_poses(points, *chunk, jnp.asarray(iterations))
        found.append(jax.tree.map(lambda array, n=count: np.asarray(array)[:n], estimate))
        meter.add(count * iterations)
    return jax.tree.map(lambda *arrays: np.concatenate(arrays), *found)
