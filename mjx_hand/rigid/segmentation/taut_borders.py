"""Borders between patches of skin, drawn taut: no teeth where triangles are large, as in the thumb's web."""

import numpy as np
from jaxtyping import Float, Int

ROUNDS = 30  # each carries a tooth's flattening on to the next edge
MARGIN = 0.08  # a border keeps this share of an edge away from its ends, so that no triangle is a sliver


def taut(
    along: Float[np.ndarray, "e"],
    crossed: Int[np.ndarray, "e 2"],
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
) -> Float[np.ndarray, "e"]:
    """Where borders cross edges, moved along the edges as a string through them would slip.

    Each crossing goes towards the middle between its neighbours. None leaves its edge, so that every vertex of the mesh
    stays on its side. Where three patches meet, the border ends in the middle of the triangle.

    Args:
        along: where the borders cross to begin with, from 0 at an edge's first end to 1 at its second.
        crossed: the edges, the lower vertex first; the others of the mesh are not crossed.
        vertices, faces: the mesh (m).
    """
    number = {pair: k for k, pair in enumerate(map(tuple, crossed.tolist()))}
    joined, met, middles = [], [], []
    for face in faces:
        i, j, k = face.tolist()
        found = [number[p] for p in ((min(x, y), max(x, y)) for x, y in ((i, j), (j, k), (k, i))) if p in number]
        if len(found) == 2:
            joined += [found, found[::-1]]
        elif len(found) == 3:
            met += found
            middles += [vertices[face].mean(axis=0)] * 3
    to, of = np.array(joined, int).reshape(-1, 2).T
    into = np.concatenate([to, np.array(met, int)])
    neighbours = np.bincount(into, minlength=len(crossed))[:, None]
    start, way = vertices[crossed[:, 0]], vertices[crossed[:, 1]] - vertices[crossed[:, 0]]
    for _ in range(ROUNDS):
        points = start + along[:, None] * way
        total = np.zeros_like(points)
        np.add.at(total, into, np.concatenate([points[of], np.reshape(middles, (-1, 3))]))
        pulled = total / neighbours - points
        # Halfway only: with the whole step two neighbours would swap places for ever.
        along = np.clip(along + (pulled * way).sum(axis=1) / (way**2).sum(axis=1) / 2, MARGIN, 1 - MARGIN)
    return along
