"""A motion at another frame rate: great arcs between rotations, straight lines between positions."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.motion.motion import Motion
from mjx_hand.pytree import replace

Array = np.ndarray


def interpolation_index(
    times: Float[Array, "n"], query: Float[Array, "q"]
) -> tuple[Int[Array, "q"], Int[Array, "q"], Float[Array, "q"]]:
    """For each query time the samples before and after it and the fraction between; held beyond the ends."""
    after = np.clip(np.searchsorted(times, query, side="right"), 1, max(len(times) - 1, 1))
    after = np.minimum(after, len(times) - 1)
    before = np.maximum(after - 1, 0)
    span = np.where(times[after] > times[before], times[after] - times[before], 1.0)
    return before, after, np.clip((query - times[before]) / span, 0.0, 1.0)


def slerp(
    a: Float[Array, "*#b 3 3"], b: Float[Array, "*#b 3 3"], fraction: Float[Array, "*#b"]
) -> Float[Array, "*c 3 3"]:
    """The rotation `fraction` of the great arc from a to b; the three broadcast."""
    shape = np.broadcast_shapes(a.shape[:-2], b.shape[:-2], np.shape(fraction))
    first = Rotation.from_matrix(np.broadcast_to(a, (*shape, 3, 3)).reshape(-1, 3, 3))
    last = Rotation.from_matrix(np.broadcast_to(b, (*shape, 3, 3)).reshape(-1, 3, 3))
    arc = (first.inv() * last).as_rotvec() * np.broadcast_to(fraction, shape).reshape(-1, 1)
    return (first * Rotation.from_rotvec(arc)).as_matrix().reshape(*shape, 3, 3)


def quaternion_matrices(quaternion: Float[Array, "t 4"]) -> Float[Array, "t 3 3"]:
    """Quaternions wxyz to matrices, in double precision."""
    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()


def matrix_quaternions(matrices: Float[Array, "t 3 3"]) -> Float[Array, "t 4"]:
    """Matrices to quaternions wxyz, each in the half space of the one before it (no sign jumps)."""
    q = Rotation.from_matrix(matrices).as_quat(scalar_first=True)
    flip = np.cumprod(np.where((q[1:] * q[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    q[1:] *= flip[:, None]
    return q


def resample_motion(motion: Motion, fps: float) -> Motion:
    """The motion sampled at `fps` frames per second, from its first frame's time to no later than its last's.

    A new frame is valid where both frames around it are; the others hold the identity and an interpolated wrist.

    Raises:
        InputError: `fps` is not a positive number, or no frame is valid.
    """
    if not np.isfinite(fps) or fps <= 0:
        raise InputError(f"fps is {fps}, expected a positive number of frames per second")
    good = np.flatnonzero(motion.valid)
    if good.size == 0:
        raise InputError(f"{motion.source or 'motion'}: all {motion.num_frames} frames are gaps; nothing to resample")
    duration = (motion.num_frames - 1) / motion.fps
    # The small term keeps the last frame where the two rates divide evenly but floats do not.
    query = np.arange(int(np.floor(duration * fps + 1e-6)) + 1) / fps
    frame = query * motion.fps
    below = np.clip(np.floor(frame + 1e-6).astype(int), 0, motion.num_frames - 1)
    above = np.clip(np.ceil(frame - 1e-6).astype(int), 0, motion.num_frames - 1)
    valid = motion.valid[below] & motion.valid[above]

    before, after, fraction = interpolation_index(good / motion.fps, query)
    before, after = good[before], good[after]
    rotations = slerp(motion.rotations[before], motion.rotations[after], fraction[:, None])
    rotations[~valid] = np.eye(3)
    wrist = quaternion_matrices(motion.wrist_quaternion)
    step = fraction[:, None]
    return replace(
        motion,
        fps=float(fps),
        rotations=rotations,
        wrist_position=(1 - step) * motion.wrist_position[before] + step * motion.wrist_position[after],
        wrist_quaternion=matrix_quaternions(slerp(wrist[before], wrist[after], fraction)),
        valid=valid,
    )
