"""Signed distances from points to objects of simple shape, differentiable, for grasp postures and grip offsets."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.spatial import ConvexHull

from mjx_hand.errors import InputError


def signed_distance(
    kind: str,
    size: Float[Array, "*#b 3"],
    point: Float[Array, "*#b 3"],
    planes: Float[Array | np.ndarray, "h f 4"] | None = None,
) -> Float[Array, "*#b"]:
    """Distance (m) from a point in the object's frame to its surface, negative inside.

    Of a mesh it is the distance to the planes of the nearest piece: less than the true one outside edges and corners.

    Args:
        kind: "box", "sphere", "cylinder", "capsule" or "mesh" (sizes as in `motion.ObjectDescription`).
        size: the object's size (m), broadcast against the points.
        point: in the object's frame (m).
        planes: of a mesh, those of its pieces (`hull_planes`).
    """
    if kind == "box":
        return _rounded(jnp.abs(point) - size)
    if kind == "sphere":
        return _norm(point) - size[..., 0]
    if kind == "cylinder":
        radial = _norm(point[..., :2]) - size[..., 0]
        axial = jnp.abs(point[..., 2]) - size[..., 1]
        return _rounded(jnp.stack([radial, axial], axis=-1))
    if kind == "capsule":
        beyond = jnp.maximum(jnp.abs(point[..., 2]) - size[..., 1], 0.0)
        return _norm(jnp.concatenate([point[..., :2], beyond[..., None]], axis=-1)) - size[..., 0]
    if kind == "mesh":
        if planes is None:
            raise InputError("a mesh needs the planes of its convex pieces: planes=hull_planes(description.hulls)")
        beyond = jnp.einsum("...k,hfk->...hf", point, planes[..., :3]) + planes[..., 3]
        return beyond.max(axis=-1).min(axis=-1)
    raise InputError(f"object kind {kind!r} is not known; valid: box, sphere, cylinder, capsule, mesh")


def hull_planes(hulls: Float[np.ndarray, "h v 3"]) -> Float[np.ndarray, "h f 4"]:
    """The faces' planes of convex pieces, given by their corners: n x + d is the distance outwards (m).

    Pieces with fewer faces repeat one.
    """
    faces = [np.unique(np.round(ConvexHull(np.unique(hull, axis=0)).equations, 9), axis=0) for hull in hulls]
    most = max(map(len, faces), default=0)
    return np.array([np.pad(rows, ((0, most - len(rows)), (0, 0)), mode="edge") for rows in faces]).reshape(
        len(faces), most, 4
    )


def half_extents(kind: str, size: Float[Array | np.ndarray, "*b 3"]) -> Float[Array, "*b 3"]:
    """Half extents (m) of the object's bounding box in its own frame."""
    if kind == "sphere":
        return jnp.stack([size[..., 0]] * 3, axis=-1)
    if kind == "cylinder":
        return jnp.stack([size[..., 0], size[..., 0], size[..., 1]], axis=-1)
    if kind == "capsule":
        return jnp.stack([size[..., 0], size[..., 0], size[..., 0] + size[..., 1]], axis=-1)
    return jnp.asarray(size)


def face_along(
    kind: str,
    size: Float[Array, "3"],
    normal: Float[Array, "3"],
    aside: Float[Array, "3"],
    planes: Float[Array | np.ndarray, "h f 4"],
) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """Where an object's surface is, seen from outside along a direction: the place (m) and the outward normal there.

    Of a simple shape it is where a plane across that direction touches it, moved by `aside`. Of a mesh it is where the
    line through `aside` leaves the outermost piece; NaN where it meets none.

    Args:
        kind, size: as in `signed_distance`.
        normal: unit direction outwards, in the object's frame.
        aside: a point of the line (m).
        planes: of a mesh, those of its pieces (`hull_planes`); of others empty.
    """
    if kind != "mesh":
        return normal * _support(kind, size, normal) + aside, normal
    planes = jnp.asarray(planes)
    slope = planes[..., :3] @ normal
    reach = -(planes[..., :3] @ aside + planes[..., 3])  # along the line, times the slope
    along = reach / jnp.where(jnp.abs(slope) < 1e-6, 1e-6, slope)
    leaves = jnp.where(slope >= 1e-6, along, jnp.inf)
    enters = jnp.where(slope <= -1e-6, along, -jnp.inf).max(axis=-1)
    beside = ((jnp.abs(slope) < 1e-6) & (reach < 0)).any(axis=-1)  # parallel to a face, and outside of it
    out = jnp.where((enters < leaves.min(axis=-1)) & ~beside, leaves.min(axis=-1), -jnp.inf)
    piece = jnp.argmax(out)
    distance = jnp.where(jnp.isfinite(out[piece]), out[piece], jnp.nan)
    return aside + distance * normal, planes[piece, jnp.argmin(leaves[piece]), :3]


def _support(kind: str, size: Float[Array, "3"], normal: Float[Array, "3"]) -> Float[Array, ""]:
    """How far (m) a simple shape reaches along a unit direction."""
    if kind == "sphere":
        return size[0]
    if kind == "capsule":
        return size[0] + jnp.abs(normal[2]) * size[1]
    if kind == "cylinder":
        return _norm(normal[:2]) * size[0] + jnp.abs(normal[2]) * size[1]
    return jnp.abs(normal) @ size


def _norm(v: Float[Array, "*b n"]) -> Float[Array, "*b"]:
    return jnp.sqrt(jnp.sum(v * v, axis=-1) + 1e-14)  # the constant keeps the gradient at the centre finite


def _rounded(outside: Float[Array, "*b n"]) -> Float[Array, "*b"]:
    """Distance to a product of intervals from the signed excess along each of its axes."""
    return _norm(jnp.maximum(outside, 0.0)) + jnp.minimum(jnp.max(outside, axis=-1), 0.0)
