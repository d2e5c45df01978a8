"""Convex pieces of an object's mesh, as physics engines need them."""

import coacd
import numpy as np
from jaxtyping import Float, Int

from mjx_hand.errors import InputError


def convex_pieces(
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
    *,
    concavity: float = 0.05,
    most: int = 16,
    corners: int = 32,
) -> Float[np.ndarray, "h c 3"]:
    """Corners of convex pieces that together fill a mesh, by approximate convex decomposition; always the same ones.

    Wei et al., Approximate Convex Decomposition for 3D Meshes with Collision-Aware Concavity and Tree Search, ACM
    Transactions on Graphics 41(4), 2022, https://arxiv.org/abs/2205.02961.

    Args:
        vertices, faces: the mesh (m), closed if it can be.
        concavity: how far a piece may be from convex, 0.01 (fine) to 1 (coarse).
        most: pieces.
        corners: of a piece; shorter rows repeat their last corner.

    Returns:
        `objects.description.ObjectDescription.hulls`.

    Raises:
        InputError: a mesh without extent, with bad numbers, or with faces that name no vertex.
    """
    vertices, faces = np.asarray(vertices, float), np.asarray(faces)
    if not np.isfinite(vertices).all():
        raise InputError("the mesh has NaN or infinite vertices; repair it first")
    if len(faces) == 0 or faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(f"the mesh has {len(faces)} faces over {len(vertices)} vertices that do not fit together")
    if np.linalg.matrix_rank(vertices - vertices.mean(axis=0), tol=1e-6) < 3:
        raise InputError("the mesh is flat; convex pieces need a solid")
    coacd.set_log_level("error")
    found = coacd.run_coacd(
        coacd.Mesh(vertices, faces.astype(np.int32)),
        threshold=concavity,
        max_convex_hull=most,
        decimate=True,
        max_ch_vertex=corners,
        seed=0,
    )
    longest = max(len(points) for points, _ in found)
    return np.stack([np.pad(points, ((0, longest - len(points)), (0, 0)), mode="edge") for points, _ in found])
