"""Points spread over the surface of a object, the same ones every time, for distances between poses."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull
from scipy.stats import qmc

from mjx_hand.errors import InputError
from mjx_hand.objects.description import OBJECT_KINDS, ObjectDescription
from mjx_hand.objects.primitives import hull_planes

_SPARE = 8  # points on a mesh's pieces for each that is wanted
_OFF = 1e-4  # m


def surface_points(description: ObjectDescription, count: int = 500) -> Float[np.ndarray, "{count} 3"]:
    """Points (m, object's frame) spread evenly over the surface: a Halton sequence, so without chance.

    Raises:
        InputError: an unknown kind, or fewer than one point.
    """
    if description.kind not in OBJECT_KINDS:
        raise InputError(f"object kind {description.kind!r} is not known; valid: {', '.join(OBJECT_KINDS)}")
    if count < 1:
        raise InputError(f"count is {count}; give at least 1 point")
    halton = qmc.Halton(d=3, scramble=False)
    halton.fast_forward(1)  # its first point is a corner
    where, u, v = halton.random(count).T
    size = np.asarray(description.size, dtype=float)
    if description.kind == "sphere":
        return size[0] * _on_unit_sphere(u, v)
    if description.kind == "cylinder":
        return _on_cylinder(size[0], size[1], where, u, v)
    if description.kind == "capsule":
        return _on_capsule(size[0], size[1], where, u, v)
    if description.kind == "mesh":
        return _on_pieces(description.hulls, count)
    return _on_box(size, where, u, v)


def _on_unit_sphere(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    height, turn = 2 * u - 1, 2 * np.pi * v  # equal steps of height cut a sphere into equal areas
    across = np.sqrt(1 - height**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)


def _on_cylinder(radius: float, half: float, where: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """`where` in [0, 1) picks the side or a lid, each as often as it is large: side 4 pi r h, a lid pi r^2."""
    side = where < 2 * half / (2 * half + radius)
    top = where >= (2 * half + radius / 2) / (2 * half + radius)
    across = np.where(side, radius, radius * np.sqrt(u))
    height = np.where(side, half * (2 * u - 1), np.where(top, half, -half))
    turn = 2 * np.pi * v
    return np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)


def _on_capsule(radius: float, half: float, where: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """`where` picks the side or the two half spheres, each as often as it is large: 4 pi r h and 4 pi r^2."""
    side = where < half / (half + radius)
    turn = 2 * np.pi * v
    tube = np.stack([radius * np.cos(turn), radius * np.sin(turn), half * (2 * u - 1)], axis=1)
    ends = radius * _on_unit_sphere(u, v)
    ends[:, 2] += np.copysign(half, ends[:, 2])
    return np.where(side[:, None], tube, ends)


def _on_pieces(hulls: np.ndarray, count: int) -> np.ndarray:
    """On the outside of the union of convex pieces: more points than needed on every piece, less those inside another.

    Raises:
        InputError: the pieces cover each other almost wholly.
    """
    corners, outward = [], []
    for hull in hulls:
        found = ConvexHull(hull)
        corners.append(hull[found.simplices])
        outward.append(found.equations[:, :3])
    corners, outward = np.concatenate(corners), np.concatenate(outward)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    halton = qmc.Halton(d=3, scramble=False)
    halton.fast_forward(1)
    where, u, v = halton.random(_SPARE * count).T
    face = np.searchsorted(np.cumsum(area) / area.sum(), where).clip(max=len(area) - 1)
    a, b, c = np.moveaxis(corners[face], 1, 0)
    root = np.sqrt(u)[:, None]  # equal areas of a triangle
    points = (1 - root) * a + root * (1 - v[:, None]) * b + root * v[:, None] * c
    # A little off their own face: pieces that were cut apart share the cut.
    off, planes = points + _OFF * outward[face], hull_planes(hulls)
    distance = (np.einsum("pk,hfk->phf", off, planes[..., :3]) + planes[..., 3]).max(axis=-1).min(axis=-1)
    outside = points[distance > 0]
    if len(outside) < count:
        raise InputError("the mesh's convex pieces cover each other almost wholly; decompose it into fewer")
    return outside[:count]


def _on_box(half: np.ndarray, where: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """`where` picks one of the six faces (-x, +x, -y, ...), each as often as it is large."""
    area = np.repeat(np.prod(half) / half, 2)
    face = np.searchsorted(np.cumsum(area) / area.sum(), where, side="right").clip(max=5)
    normal = face // 2
    points = np.empty((len(where), 3))
    rows = np.arange(len(where))
    points[rows, normal] = np.where(face % 2, 1.0, -1.0)
    points[rows, (normal + 1) % 3] = 2 * u - 1
    points[rows, (normal + 2) % 3] = 2 * v - 1
    return points * half
