"""An object's surface as the general road uses it: outline, stable ways to stand, samples, convex pieces."""

import dataclasses

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from mjx_hand.errors import InputError
from mjx_hand.files.array_cache import cached
from mjx_hand.motion.scene import NO_SURFACE, RecordedObject
from mjx_hand.objects.convex_decomposition import convex_pieces
from mjx_hand.objects.mesh_file import check_object_size
from mjx_hand.objects.outermost import outermost
from mjx_hand.objects.primitives import hull_planes

_DIRECTIONS, _CORNERS = 400, 96  # of an outline; corners of a piece that was convex already
_CONVEX, _CONCAVITY = 0.97, 0.05  # share of its hull's volume that a convex mesh has; of what is cut
# Rad within which faces are one, and ways to stand are; m by which a foot is uneven; as many ways to stand: a ball.
_SAME, _APART, _FLAT, _ROUND = np.deg2rad(8.0), np.deg2rad(25.0), 0.003, 32
_FOOT_CORNERS = 12
_SPACING = 0.006  # m between samples of a surface, at most
_SMALL = 0.1  # a piece that is there only for its number, as a share of the piece that it is in


@dataclasses.dataclass(frozen=True)
class Solid:
    """An object's surface, in its own frame; metres.

    Attributes:
        vertices, faces: of its mesh.
        outline: few of the points of its convex hull.
        stands: unit vectors of it that point up where it stands in a stable way, the surest first; none of a ball.
        feet: how large a face it then stands on (m²).
        volume: m³: of the mesh where that is closed, else of its convex hull.
        closed: whether the mesh is.
    """

    vertices: Float[np.ndarray, "v 3"]
    faces: np.ndarray
    outline: Float[np.ndarray, "c 3"]
    stands: Float[np.ndarray, "k 3"]
    feet: Float[np.ndarray, "k"]
    volume: float
    closed: bool

    def lowest(self, rotation: Float[np.ndarray, "*t 3 3"], up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "*t"]:
        """Height (m) of its lowest point above its origin."""
        return np.asarray(np.min((up @ rotation) @ self.outline.T, axis=-1))


def solid_of(recorded: RecordedObject, where: str) -> Solid:
    """The object's surface: its mesh, or that of its shape.

    Raises:
        InputError: only its poses are known; its mesh is flat, or of a size that no hand holds.
    """
    if recorded.kind == NO_SURFACE:
        raise InputError(
            f"{where}: object {recorded.name!r} has poses without a mesh; add it, mjx-hand scene --object "
            f"{recorded.name}=mesh.stl"
        )
    mesh = _mesh(recorded)
    vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, int)
    check_object_size(f"{where}: object {recorded.name!r}", vertices, faces)
    outline = outermost(vertices, _DIRECTIONS)
    try:
        hull = ConvexHull(outline)
    except QhullError:
        raise InputError(f"{where}: object {recorded.name!r} is flat; give a mesh with thickness") from None
    closed = bool(mesh.is_watertight and mesh.volume > 0)
    centre = np.asarray(mesh.center_mass if closed else outline[hull.vertices].mean(axis=0), float)
    volume = float(mesh.volume) if closed else float(hull.volume)
    return Solid(vertices, faces, outline, *_stands(hull, outline, centre), volume, closed)


def samples(solid: Solid) -> Float[np.ndarray, "n 3"]:
    """Points of the surface, nowhere further apart than some millimetres."""
    return np.asarray(trimesh.remesh.subdivide_to_size(solid.vertices, solid.faces, _SPACING, max_iter=20)[0])


def pieces_of(solid: Solid, most: int) -> Float[np.ndarray, "h c 3"]:
    """Corners of convex pieces that fill it; of a convex one its hull's."""
    hull = ConvexHull(solid.outline)
    if solid.closed and solid.volume > _CONVEX * hull.volume:
        return outermost(solid.vertices, _CORNERS)[None]
    vertices, faces = solid.vertices, solid.faces

    def cut() -> dict[str, np.ndarray]:
        return {"hulls": convex_pieces(vertices, faces, concavity=_CONCAVITY, most=most)}

    return cached(cut, vertices, faces, _CONCAVITY, most)["hulls"]


def as_many(hulls: Float[np.ndarray, "h c 3"], count: int) -> Float[np.ndarray, "k c 3"]:
    """The pieces with others inside the first one, so small that they touch nothing, up to `count`: scenes that run
    side by side have equally many."""
    middle = hulls[0].mean(axis=0)
    small = middle + _SMALL * (hulls[0] - middle)
    return np.concatenate([hulls, np.repeat(small[None], count - len(hulls), axis=0)])


def with_foot(
    hulls: Float[np.ndarray, "h c 3"], solid: Solid, stand: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "h k 3"]:
    """The pieces with the flat foot on which the object stands: few corners of few pieces make it none.

    Args:
        hulls: corners of its pieces.
        solid: its surface.
        stand: up in its own frame.
    """
    reach = solid.outline @ stand
    lowest = reach.min()
    axes = _across(stand)
    turn = np.linspace(0, 2 * np.pi, _FOOT_CORNERS, endpoint=False)
    foot = solid.outline[reach < lowest + _FLAT]
    corners = foot[np.unique(np.argmax(foot @ axes.T @ np.stack([np.cos(turn), np.sin(turn)]), axis=0))]
    corners = corners - ((corners @ stand) - lowest)[:, None] * stand
    planes = hull_planes(hulls)
    off = (np.einsum("ck,hfk->chf", corners, planes[..., :3]) + planes[..., 3]).max(axis=-1)
    low = hulls @ stand
    flat = hulls - np.where(low < lowest + _FLAT, low - lowest, 0.0)[..., None] * stand
    extra = np.repeat(flat[:, -1:], len(corners), axis=1)
    extra[np.argmin(off, axis=1), np.arange(len(corners))] = corners
    return np.concatenate([flat, extra], axis=1)


def _mesh(recorded: RecordedObject) -> trimesh.Trimesh:
    a, b = recorded.size[:2]
    match recorded.kind:
        case "box":
            return trimesh.creation.box(2 * recorded.size)
        case "sphere":
            return trimesh.creation.icosphere(3, a)
        case "cylinder":
            return trimesh.creation.cylinder(a, 2 * b, sections=48)
        case "capsule":
            mesh = trimesh.creation.capsule(2 * b, a)
            return mesh.apply_translation(-mesh.bounds.mean(axis=0))
        case _:
            return trimesh.Trimesh(recorded.vertices, recorded.faces)


def _across(normal: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2 3"]:
    """Two unit vectors at right angles to each other and to a unit vector."""
    x = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x)])


def _stands(hull: ConvexHull, points: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Up in its frame where it stands on one of its hull's faces, its centre of mass above that; and their areas."""
    corners = points[hull.simplices]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    found: list[tuple[float, np.ndarray]] = []
    taken = np.zeros(len(area), bool)
    for k in np.argsort(-area):
        if taken[k]:
            continue
        normal = hull.equations[k, :3]
        taken |= hull.equations[:, :3] @ normal > np.cos(_SAME)
        reach = points @ normal
        plane = _across(normal).T
        foot = points[reach > reach.max() - _FLAT] @ plane
        try:
            edge = ConvexHull(foot)
        except (QhullError, ValueError):
            continue
        if (edge.equations[:, :2] @ (centre @ plane) + edge.equations[:, 2] < 0).all():
            found.append((edge.volume, -normal))
    found.sort(key=lambda one: -one[0])
    apart: list[tuple[float, np.ndarray]] = []
    for area, up in found:
        if all(up @ other < np.cos(_APART) for _, other in apart):
            apart.append((area, up))
    found = apart if len(apart) < _ROUND else []
    return np.array([up for _, up in found]).reshape(-1, 3), np.array([area for area, _ in found])
