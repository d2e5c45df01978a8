"""Solving with a symmetric matrix that has a tree's structure, unrolled when it is traced.

Unknowns are eliminated from the last to the first. Joints stand after their parents, so that a finger is eliminated
before the base that it hangs on, and no entry appears that was not there.
"""

import jax.numpy as jnp

from mjx_hand.robots.solver.triples import Scalar, Scalars

Entries = dict[tuple[int, int], Scalar]  # (row, column), row ≥ column


def solve_definite(matrix: Entries, right: Scalars, floor: Scalars) -> Scalars:
    """The solution of matrix @ x = right (L D Lᵀ), with the matrix made positive definite on the way.

    A pivot counts by its size, and by no less than `floor`: a saddle's descending direction is descended as steeply as
    it would be climbed (Nocedal and Wright, Numerical Optimization, 2nd ed., section 3.4).
    """
    left, count = dict(matrix), len(right)
    right = list(right)
    inverse: Scalars = [0.0] * count
    factor: Entries = {}
    for k in reversed(range(count)):
        inverse[k] = 1 / jnp.maximum(jnp.abs(left[k, k]), floor[k])
        inner = [j for j in range(k) if (k, j) in left]
        for j in inner:
            factor[k, j] = left[k, j] * inverse[k]
        for j in inner:
            for i in (i for i in inner if i <= j):
                change = factor[k, j] * left[k, i]
                left[j, i] = left[j, i] - change if (j, i) in left else -change
            right[j] = right[j] - factor[k, j] * right[k]
    solution: Scalars = []
    for k in range(count):
        value = right[k] * inverse[k]
        for j in (j for j in range(k) if (k, j) in factor):
            value = value - factor[k, j] * solution[j]
        solution.append(value)
    return solution
