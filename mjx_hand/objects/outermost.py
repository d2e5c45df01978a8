"""`outermost`: few of a mesh's vertices that keep its outline."""

import numpy as np
from jaxtyping import Float


def outermost(vertices: Float[np.ndarray, "v 3"], directions: int) -> Float[np.ndarray, "c 3"]:
    """Those of a mesh's vertices that are the furthest in some of many directions, spread evenly over the sphere.

    Args:
        vertices: of a mesh, or of its hull.
        directions: how many, besides the 26 along the axes and between them. The first vertex always stays.
    """
    turn = np.arange(directions) * (np.pi * (3 - np.sqrt(5)))  # a Fibonacci sphere
    height = np.linspace(-1, 1, directions)
    across = np.sqrt(1 - height**2)
    spread = np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
    axes = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)], float)
    near = vertices - vertices.mean(axis=0)
    return vertices[np.unique(np.argmax(near @ np.concatenate([axes, spread]).T, axis=0))]
