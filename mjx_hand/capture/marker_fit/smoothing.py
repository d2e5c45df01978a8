"""Fingers have mass: the smooth course of a joint that each frame's own estimate supports as far as it is certain.

The same penalty as `retarget.smoothing`, which weights all recorded frames alike and is compiled to run over many
recordings at once. Here each joint of each frame has its own weight, and double precision is at hand: a banded
factorisation is the whole solver.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solveh_banded

Array = np.ndarray


def smooth_vectors(
    vectors: Float[Array, "b 15 3"],
    covariance: Float[Array, "b 15 3 3"],
    prior_precision: Float[Array, "15 3 3"],
    frames: Int[Array, "b"],
    acceleration: float,
) -> Float[Array, "b 15 3"]:
    """Rotation vectors (rad) smoothed over time, each component by itself (Whittaker 1923; Eilers 2003).

    Minimises sum w (x - v)^2 + sum (second difference of x)^2 / acceleration^2, where the weight w is what the frame's
    markers say: a joint whose markers are hidden follows the frames before and after.

    Args:
        vectors: each frame's own estimate.
        covariance: its posterior covariance, joint by joint.
        prior_precision: the pose prior's. Its eigenvectors are the components; it is taken out of the weights but
            for a twentieth, because the frames of a gap would otherwise count it as so many observations.
        frames: frame numbers; those between them are gaps.
        acceleration: standard deviation of the second difference, rad a frame^2.
    """
    eigenvalues, axes = np.linalg.eigh(prior_precision.astype(np.float64))
    values = np.einsum("jac,bja->bjc", axes, vectors)
    variance = np.einsum("jac,bjad,jdc->bjc", axes, covariance, axes)
    weight = np.maximum(1 / variance - eigenvalues, 0.0) + 0.05 * eigenvalues

    at = frames - frames[0]
    count = int(at[-1]) + 1
    if count < 3:
        return vectors
    penalty = second_difference_bands(count) / acceleration**2
    smooth = np.empty_like(values)
    for joint, axis in np.ndindex(values.shape[1:]):
        bands, right = penalty.copy(), np.zeros(count)
        bands[0, at] += weight[:, joint, axis]
        right[at] = weight[:, joint, axis] * values[:, joint, axis]
        smooth[:, joint, axis] = solveh_banded(bands, right, lower=True)[at]
    return np.einsum("jac,bjc->bja", axes, smooth)


def second_difference_bands(count: int) -> Float[Array, "3 n"]:
    """The matrix DᵀD of second differences of `count` samples, as its diagonal and two bands below."""
    bands = np.zeros((3, count))
    for first, second in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)):
        bands[second - first, first : first + count - 2] += (1.0, -2.0, 1.0)[first] * (1.0, -2.0, 1.0)[second]
    return bands
