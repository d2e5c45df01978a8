"""The rotation off a joint's main axis that real fingers show and hinge models lack."""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_BALL_JOINTS

Array = np.ndarray
KNOT_INTERVAL = 0.4  # s between the independent values of the smooth course
# The largest rotation off the best single axis in a real recording (DexMV's mustard bottle, arXiv 2108.05877):
# MCP, PIP, DIP in degrees. The thumb's CMC, MCP and IP are given the same.
PEAK = np.deg2rad([16.0, 8.0, 3.0])


def add_off_axis_rotation(
    rotations: Float[Array, "t 15 3 3"], seed: int, scale: float, fps: float
) -> Float[Array, "t 15 3 3"]:
    """Add a smooth rotation at right angles to each joint's main axis.

    The main axis is the joint's own over the sequence: the principal direction of its rotation vectors. The peak of
    what is added is between half of and the whole of `scale` times what real recordings reach (`PEAK`).

    Args:
        rotations: relative rotations of the 15 joints.
        seed: of the random course.
        scale: 1 for the size of real recordings, 0 for none.
        fps: frames per second.

    Raises:
        InputError: scale or fps is out of range.
    """
    if not (np.isfinite(scale) and scale >= 0 and np.isfinite(fps) and fps > 0):
        raise InputError(f"scale is {scale} and fps {fps}; expected scale of 0 or more, fps above 0")
    rng = np.random.default_rng(seed)
    frames = rotations.shape[0]
    vectors = Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_rotvec().reshape(frames, NUM_BALL_JOINTS, 3)
    first, second = minor_directions(vectors)
    course = smooth_course(rng, frames, fps)
    peak = PEAK[np.arange(NUM_BALL_JOINTS) % 3] * rng.uniform(0.5, 1.0, NUM_BALL_JOINTS)
    added = course[..., :1] * first + course[..., 1:] * second
    added *= scale * peak[:, None] / np.linalg.norm(added, axis=-1, keepdims=True).max(axis=0)
    off = Rotation.from_rotvec(added.reshape(-1, 3)).as_matrix().reshape(rotations.shape)
    return off @ rotations


def minor_directions(
    vectors: Float[Array, "t 15 3"],
) -> tuple[Float[Array, "15 3"], Float[Array, "15 3"]]:
    """Two directions at right angles to each joint's principal direction of rotation."""
    moments = np.einsum("tja,tjb->jab", vectors, vectors)
    directions = np.linalg.eigh(moments).eigenvectors
    return directions[..., 1], directions[..., 0]


def smooth_course(rng: np.random.Generator, frames: int, fps: float) -> Float[Array, "t 15 2"]:
    """Two smooth random courses per joint: cubic splines through independent normal values."""
    times = np.arange(frames) / fps
    knots = np.arange(0.0, times[-1] + 2 * KNOT_INTERVAL, KNOT_INTERVAL)
    return CubicSpline(knots, rng.normal(size=(len(knots), NUM_BALL_JOINTS, 2)))(times)
