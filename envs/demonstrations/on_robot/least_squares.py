"""Damped least squares over a hand's targets, wrist included: one grasp, then frame after frame."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

# `envs.live.twin.hand_solver` is another such loop: see there why the two are not one.
Equations = Callable[[Float[np.ndarray, "u"]], tuple[Float[np.ndarray, "r"], Float[np.ndarray, "r u"]]]


def solve(
    equations: Equations,
    start: Float[np.ndarray, "u"],
    low: Float[np.ndarray, "u"],
    high: Float[np.ndarray, "u"],
    steps: int,
) -> tuple[Float[np.ndarray, "u"], float]:
    """Targets within limits that make the residuals least, and half their sum of squares; Levenberg and Marquardt's.

    Args:
        equations: residuals and their derivatives.
        start: where to begin.
        low, high: limits.
        steps: how many are tried; one that makes things worse is not taken.
    """
    at, damping = np.clip(start, low, high), 1e-2
    residual, slope = equations(at)
    cost = float(residual @ residual) / 2
    for _ in range(steps):
        square, down = slope.T @ slope, slope.T @ residual
        held = ((at <= low) & (down > 0)) | ((at >= high) & (down < 0))  # against a limit that they press on
        free = ~held
        change = np.zeros_like(at)
        inner = square[np.ix_(free, free)]
        change[free] = np.linalg.solve(inner + damping * np.diag(np.diag(inner) + 1e-9), -down[free])
        there = np.clip(at + change, low, high)
        new, new_slope = equations(there)
        new_cost = float(new @ new) / 2
        if new_cost < cost:
            small = cost - new_cost < 1e-6 * cost
            at, residual, slope, cost, damping = there, new, new_slope, new_cost, damping / 4
            if small:
                break
        else:
            damping *= 6
    return at, cost
