"""The linear shape space of flat hands: mean, principal components, and the joints that follow them."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

COMPONENTS = 10
REGRESSOR_NONZEROS = 12
# The regressor's vertices for a joint are sought among this many nearest ones.
REGRESSOR_CANDIDATES = 150


@dataclass(frozen=True)
class ShapeSpace:
    """Vertices = mean + directions @ beta, beta of unit variance over the population; joints likewise (metres)."""

    mean: np.ndarray  # (v, 3)
    directions: np.ndarray  # (v, 3, 10)
    joint_mean: np.ndarray  # (16, 3)
    joint_directions: np.ndarray  # (16, 3, 10)
    residual: float  # root mean square distance of the population's vertices from the space, metres
    explained: float  # share of the variance


def fit_shape_space(vertices: np.ndarray, joints: np.ndarray) -> ShapeSpace:
    """Principal components of hands (n, v, 3), and the joints (n, 16, 3) by least squares on the same scores.

    The sign of a component is free; here +beta lengthens the hand or, where a component changes its length by less than
    a millimetre, makes the component's largest entry positive.
    """
    n, v = vertices.shape[:2]
    mean = vertices.mean(axis=0)
    data = (vertices - mean).reshape(n, -1)
    values, scores = np.linalg.eigh(data @ data.T)  # n is smaller than 3 v
    values, scores = values[::-1][:COMPONENTS], scores[:, ::-1][:, :COMPONENTS]
    directions = data.T @ scores / np.sqrt(n)  # one standard deviation each
    strongest = np.abs(directions).argmax(axis=0)
    sign = np.sign(directions[strongest, np.arange(COMPONENTS)])
    along = directions.reshape(v, 3, COMPONENTS)[:, 0]
    reach = along[mean[:, 0].argmax()] - along[mean[:, 0].argmin()]  # the forearm's end against the middle finger's tip
    sign = np.where(np.abs(reach) > 1e-3, np.sign(reach), sign)
    directions, beta = directions * sign, scores * np.sqrt(n) * sign

    residual = data - beta @ directions.T
    design = np.column_stack([np.ones(n), beta])
    solution = np.linalg.lstsq(design, joints.reshape(n, -1), rcond=None)[0].reshape(-1, joints.shape[1], 3)
    return ShapeSpace(
        mean=mean,
        directions=directions.reshape(v, 3, COMPONENTS),
        joint_mean=solution[0],
        joint_directions=np.moveaxis(solution[1:], 0, -1),
        residual=float(np.sqrt((residual**2).sum() / (n * v))),
        explained=float(1 - (residual**2).sum() / (data**2).sum()),
    )


def fit_joint_regressor(space: ShapeSpace) -> tuple[np.ndarray, float]:
    """Non-negative rows (16, v) that sum to 1 and take the space's vertices to its joints.

    Each row has at most `REGRESSOR_NONZEROS` entries, near its joint.

    Returns:
        The regressor, and its root mean square error over the population, metres.
    """
    joints, v = len(space.joint_mean), len(space.mean)
    regressor = np.zeros((joints, v))
    stacked = np.concatenate([space.mean[..., None], space.directions], axis=-1)  # (v, 3, 11)
    goal = np.concatenate([space.joint_mean[..., None], space.joint_directions], axis=-1)
    for j in range(joints):
        near = np.argsort(np.linalg.norm(space.mean - space.joint_mean[j], axis=1))[:REGRESSOR_CANDIDATES]
        regressor[j] = _sparse_row(stacked, goal[j], near)
    error = np.einsum("jv,vck->jck", regressor, stacked) - goal
    return regressor, float(np.sqrt((error**2).sum(axis=(1, 2)).mean()))


def _sparse_row(stacked: np.ndarray, goal: np.ndarray, support: np.ndarray) -> np.ndarray:
    """Non-negative least squares, dropping the least entries until few enough are left."""
    row = np.zeros(len(stacked))
    while True:
        # The sum-to-one row weighs a metre: far more than any length here.
        matrix = np.vstack([stacked[support].reshape(len(support), -1).T, np.ones(len(support))])
        solution = nnls(matrix, np.append(goal.ravel(), 1.0))[0]
        used = np.flatnonzero(solution > 0)
        if len(used) <= REGRESSOR_NONZEROS:
            row[support[used]] = solution[used] / solution[used].sum()
            return row
        support = support[used[np.argsort(solution[used])[1:]]]
