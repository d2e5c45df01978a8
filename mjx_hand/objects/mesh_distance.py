"""Signed distance from points to a closed triangle mesh, and which way the surface lies."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from mjx_hand.errors import InputError

_ON_SURFACE = 1e-7  # m; nearer than this the direction is the triangle's own normal
_POINTS = 64  # points per call; each is compared with every triangle


def signed_distance(
    points: Float[np.ndarray, "n 3"], vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n 3"]]:
    """Distance (m, negative inside) to a closed surface, and the unit direction in which it grows.

    Every triangle is tried: the nearest point of a triangle is the plane's, if that lies in it, else an edge's. Inside
    is where the winding number, the sum of the triangles' solid angles (Van Oosterom and Strackee 1983) over 4π, is 1.

    Args:
        points: in the mesh's frame.
        vertices: of the mesh (m).
        faces: triangles, outward by the right-hand rule.

    Raises:
        InputError: the mesh is empty, not finite, or has an index beyond its vertices.
    """
    vertices, faces = np.asarray(vertices, np.float32), np.asarray(faces)
    if len(faces) == 0 or not np.isfinite(vertices).all():
        raise InputError(f"the mesh has {len(faces)} triangles and must have some, all of finite vertices")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(f"the mesh's triangles name vertex {faces.max()}; it has {len(vertices)}")
    corners = jnp.asarray(vertices[faces])
    padded = np.zeros((-(-len(points) // _POINTS) * _POINTS, 3), np.float32)
    padded[: len(points)] = points
    parts = [_nearest(jnp.asarray(part), corners) for part in padded.reshape(-1, _POINTS, 3)]
    distance, direction = (np.concatenate([np.asarray(part[k]) for part in parts])[: len(points)] for k in (0, 1))
    return distance, direction


@jax.jit
def _nearest(points: Float[Array, "n 3"], corners: Float[Array, "f 3 3"]) -> tuple[Array, Array]:
    normal = jnp.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= jnp.maximum(jnp.linalg.norm(normal, axis=-1, keepdims=True), 1e-20)
    ends = jnp.roll(corners, -1, axis=1)
    edge = ends - corners
    inward = jnp.cross(normal[:, None], edge)
    length = jnp.maximum(jnp.sum(edge**2, axis=-1), 1e-20)

    def one(point: Array) -> tuple[Array, Array]:
        to = point - corners  # from each corner, which begins an edge
        over = jnp.all(jnp.sum(to * inward, axis=-1) >= 0, axis=-1)
        height = jnp.sum(to[:, 0] * normal, axis=-1)
        along = jnp.clip(jnp.sum(to * edge, axis=-1) / length, 0.0, 1.0)
        from_edge = to - along[..., None] * edge
        nearest_edge = jnp.argmin(jnp.sum(from_edge**2, axis=-1), axis=-1)
        from_edge = jnp.take_along_axis(from_edge, nearest_edge[:, None, None], axis=1)[:, 0]
        away = jnp.where(over[:, None], height[:, None] * normal, from_edge)
        best = jnp.argmin(jnp.sum(away**2, axis=-1))
        size = jnp.sqrt(jnp.sum(away[best] ** 2))

        a, b, c = to[:, 0], to[:, 1], to[:, 2]
        la, lb, lc = (jnp.linalg.norm(x, axis=-1) for x in (a, b, c))
        volume = jnp.sum(a * jnp.cross(b, c), axis=-1)
        spread = la * lb * lc + jnp.sum(a * b, -1) * lc + jnp.sum(b * c, -1) * la + jnp.sum(c * a, -1) * lb
        # The corners seen from the point are -a, -b, -c, which turns the sign of the volume.
        winding = jnp.sum(jnp.arctan2(-volume, spread)) / (2 * jnp.pi)
        sign = jnp.where(winding > 0.5, -1.0, 1.0)
        grows = sign * away[best] / jnp.maximum(size, _ON_SURFACE)
        return sign * size, jnp.where(size > _ON_SURFACE, grows, normal[best])

    return jax.lax.map(one, points)
