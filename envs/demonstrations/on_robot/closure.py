"""Force closure: whether contacts could hold an object against any force and torque, by friction and pressing alone.

Contacts are soft fingers (Murray, Li and Sastry, A Mathematical Introduction to Robotic Manipulation, 5.3): a friction
cone, and a little torque about the normal, each as a few edges. They close where a positive combination of all edges is
zero and the edges span every force and torque.
"""

import numpy as np
from jaxtyping import Float
from scipy.optimize import linprog

_EDGES = 8  # of a friction cone
_TWIST = 0.005  # m: torque about the normal over the force along it and the friction
_LENGTH = 0.05  # m, a lever by which torques count as forces
_LEAST = 1e-4  # of each edge's share, that rounding does not make


def closes(points: Float[np.ndarray, "c 3"], inward: Float[np.ndarray, "c 3"], friction: float) -> bool:
    """Whether contacts have force closure.

    Args:
        points: where they are (m).
        inward: unit ways into the object.
        friction: coefficient.
    """
    if len(points) < 2:
        return False
    wrenches = np.concatenate(
        [_edges(*each, friction) for each in zip(points - points.mean(axis=0), inward, strict=True)]
    )
    if np.linalg.matrix_rank(wrenches, tol=1e-6) < 6:
        return False
    count = len(wrenches)
    # The largest share t that every edge can have while they add up to nothing.
    balance = np.vstack([np.column_stack([wrenches.T, np.zeros(6)]), np.append(np.ones(count), 0.0)])
    least = np.column_stack([-np.eye(count), np.ones(count)])
    found = linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=least,
        b_ub=np.zeros(count),
        A_eq=balance,
        b_eq=np.append(np.zeros(6), 1.0),
        bounds=[(0, None)] * (count + 1),
    )
    return bool(found.success and -found.fun > _LEAST / count)


def _edges(point: Float[np.ndarray, "3"], inward: Float[np.ndarray, "3"], friction: float) -> Float[np.ndarray, "e 6"]:
    """Forces (N) and torques (N m over a lever) of one contact's edges, each with a normal force of 1 N."""
    side = np.cross(inward, np.eye(3)[np.argmin(np.abs(inward))])
    side /= np.linalg.norm(side)
    angles = np.linspace(0, 2 * np.pi, _EDGES, endpoint=False)
    across = np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * np.cross(inward, side)
    forces = np.concatenate([inward + friction * across, np.stack([inward, inward])])
    torques = np.cross(point, forces)
    torques[-2:] += friction * _TWIST * np.stack([inward, -inward])
    return np.concatenate([forces, torques / _LENGTH], axis=1)
