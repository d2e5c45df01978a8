"""Heat that spreads over a triangle mesh: what smooths a field on skin whose triangles are of many sizes."""

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import splu

STEPS = 3  # of implicit Euler, which blurs ever more like true heat the more there are
# Triangles with an angle near or above 90 degrees would conduct backwards, and the field leave its own range.
_LEAST_CONDUCTANCE = 0.01


def diffused(
    field: Float[np.ndarray, "v k"],
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
    width: float,
) -> Float[np.ndarray, "v k"]:
    """Fields over a surface, blurred with about a Gaussian's standard deviation `width` (m).

    Implicit Euler steps of the heat equation with the cotangent Laplacian (Desbrun, Meyer, Schroeder and Barr,
    "Implicit fairing of irregular meshes using diffusion and curvature flow", SIGGRAPH 1999). Values stay within their
    range.
    """
    count = len(vertices)
    area = np.full(count, 1e-12)  # not zero where a vertex has no triangle
    rows, columns, conductance = [], [], []
    for k in range(3):
        a, b, apex = faces[:, k], faces[:, k - 2], faces[:, k - 1]
        to_a, to_b = vertices[a] - vertices[apex], vertices[b] - vertices[apex]
        twice = np.maximum(np.linalg.norm(np.cross(to_a, to_b), axis=1), 1e-12)
        across = np.maximum((to_a * to_b).sum(axis=1) / twice / 2, _LEAST_CONDUCTANCE)
        rows += [a, b]
        columns += [b, a]
        conductance += [across, across]
        np.add.at(area, a, twice / 6)
    between = coo_array((np.concatenate(conductance), (np.concatenate(rows), np.concatenate(columns))), (count, count))
    laplacian = diags_array(between.sum(axis=1)) - between
    step = width**2 / 2 / STEPS
    solve = splu(csc_array(diags_array(area) + step * laplacian)).solve
    for _ in range(STEPS):
        field = solve(area[:, None] * field)
    return field
