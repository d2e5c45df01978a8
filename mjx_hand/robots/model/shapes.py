"""Shapes of a robot's links: boxes, cylinders, spheres and meshes of a URDF, and what of them touches."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import shown
from mjx_hand.objects.outermost import outermost
from mjx_hand.robots.mjcf_file import ReadMesh

COLLISIONS = ("hulls", "capsules")
_THICK, _SHORT = 0.008, 0.006  # m: the radius of a capsule along a bone, and a bone that needs none
_SAMPLES = 2000  # points of a surface, by which shapes are compared
# Of a hull, and of one with more the directions in which what is kept is foremost. A finely rounded link has thousands,
# and a training holds hundreds of scenes; what is left out of a ball of 3 cm is 0.05 mm thick.
_MOST_VERTICES, _DIRECTIONS = 3000, 1500


class AbsentMeshError(InputError):
    """A mesh that a robot's file names is not there."""


@dataclass(frozen=True)
class Shape:
    """A shape in a link's frame (m).

    Attributes:
        kind: "box", "cylinder", "sphere", "capsule" or "mesh".
        size: half extents; radius and half length; radius.
        place: link_from_shape, 4 x 4.
        vertices, faces: of a mesh, in the link's frame, whatever its place says.
    """

    kind: str
    size: tuple[float, ...]
    place: Float[np.ndarray, "4 4"]
    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]


def shapes_of(path: Path, link: str, given: Sequence[Any]) -> tuple[Shape, ...]:
    """The shapes of a link's `<visual>` or `<collision>` elements.

    Raises:
        InputError: a mesh that is not there or cannot be read, or a shape of no size.
    """
    return tuple(_shape(path, link, each) for each in given if each.geometry is not None)


def is_there(path: Path, given: Any) -> bool:
    """Whether a `<visual>` or `<collision>` element is of a shape whose file, if it needs one, is there."""
    mesh = None if given.geometry is None else given.geometry.mesh
    return mesh is None or isinstance(mesh, ReadMesh) or mesh_file(path, mesh.filename) is not None


def hull(shape: Shape) -> Shape:
    """What of a shape touches: a mesh's convex hull; others as they are."""
    if shape.kind != "mesh":
        return shape
    try:
        convex = trimesh.convex.convex_hull(shape.vertices)
    except Exception:  # flat or empty, as Qhull says in many ways
        low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
        return box(np.maximum((high - low) / 2, 5e-4), (low + high) / 2)
    if len(convex.vertices) > _MOST_VERTICES:
        convex = trimesh.convex.convex_hull(outermost(np.asarray(convex.vertices, float), _DIRECTIONS))
    return Shape("mesh", (), np.eye(4), np.asarray(convex.vertices, float), np.asarray(convex.faces, int))


def bones(ends: Sequence[Float[np.ndarray, "3"]]) -> tuple[Shape, ...]:
    """Capsules from a link's origin to where it carries others (m), for a link of no known shape."""
    made = []
    for end in ends:
        length = float(np.linalg.norm(end))
        if length > _SHORT:
            solid = trimesh.creation.capsule(height=length, radius=_THICK)
            solid.apply_translation([0, 0, length / 2 - solid.bounds.mean(axis=0)[2]])
            place = np.asarray(trimesh.geometry.align_vectors([0, 0, 1], end / length))
            middle = place @ np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, length / 2], [0, 0, 0, 1.0]])
            solid.apply_transform(place)
            made.append(
                Shape(
                    "capsule",
                    (_THICK, length / 2),
                    middle,
                    np.asarray(solid.vertices, float),
                    np.asarray(solid.faces, int),
                )
            )
    return tuple(made)


def capsule(shape: Shape) -> Shape:
    """The capsule along a shape's longest axis that is as thick as the other two are on average."""
    if shape.kind in ("sphere", "capsule"):
        return shape
    outline = trimesh.bounds.oriented_bounds(shape.vertices)
    to_middle, extents = outline
    order = np.argsort(extents)[::-1]
    long, radius = float(extents[order[0]]) / 2, float(np.mean(extents[order[1:]])) / 2
    place = np.linalg.inv(to_middle)
    axes = place[:3, :3][:, [order[1], order[2], order[0]]]
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    place = np.block([[axes, place[:3, 3:]], [np.zeros((1, 3)), np.ones((1, 1))]])
    radius = min(radius, long)
    made = trimesh.creation.capsule(height=2 * (long - radius), radius=radius)
    vertices = made.vertices - made.bounds.mean(axis=0)
    return _primitive("capsule", (radius, max(long - radius, 1e-6)), place, vertices, made.faces)


def box(half: Float[np.ndarray, "3"], centre: Float[np.ndarray, "3"]) -> Shape:
    """A box along a link's axes."""
    place = np.eye(4)
    place[:3, 3] = centre
    made = trimesh.creation.box(2 * half)
    return _primitive(
        "box", tuple(float(h) for h in half), place, np.asarray(made.vertices, float), np.asarray(made.faces, int)
    )


def off_the_mesh(touching: Sequence[Shape], visual: Sequence[Shape]) -> Float[np.ndarray, "n"]:
    """How far (m) points of what touches are from the surface that is seen, those inside another shape left out."""
    if not touching or not visual:
        return np.zeros(0)
    seen = np.concatenate([_samples(shape) for shape in visual])
    tree, distances = KDTree(seen), []
    solids = [trimesh.convex.convex_hull(shape.vertices) for shape in touching]
    for k, shape in enumerate(touching):
        points = _samples(shape)
        hidden = np.zeros(len(points), bool)
        for other in (solid for j, solid in enumerate(solids) if j != k):
            normals, origins = other.face_normals, other.triangles[:, 0]
            hidden |= (((points[:, None] - origins) * normals).sum(axis=-1) < -1e-5).all(axis=1)
        distances.append(tree.query(points[~hidden])[0])
    return np.concatenate(distances)


def _samples(shape: Shape) -> Float[np.ndarray, "n 3"]:
    surface = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    return np.asarray(trimesh.sample.sample_surface(surface, _SAMPLES, seed=0)[0])


def _shape(path: Path, link: str, given: Any) -> Shape:
    place = np.eye(4) if given.origin is None else np.asarray(given.origin, float)
    geometry = given.geometry
    if geometry.box is not None:
        made, kind = trimesh.creation.box(_sizes(path, link, geometry.box.size)), "box"
        size = tuple(float(value) / 2 for value in geometry.box.size)
    elif geometry.cylinder is not None:
        radius, length = _sizes(path, link, [geometry.cylinder.radius, geometry.cylinder.length])
        made, kind, size = trimesh.creation.cylinder(radius, length), "cylinder", (float(radius), float(length) / 2)
    elif geometry.sphere is not None:
        (radius,) = _sizes(path, link, [geometry.sphere.radius])
        made, kind, size = trimesh.creation.icosphere(3, radius), "sphere", (float(radius),)
    elif isinstance(geometry.mesh, ReadMesh):
        made, kind, size = geometry.mesh.surface, geometry.mesh.kind, geometry.mesh.size
    elif geometry.mesh is not None:
        made, kind, size = _mesh(path, link, geometry.mesh), "mesh", ()
    else:
        raise InputError(f"{path}: link {shown(link)} has an unknown shape; valid: box, cylinder, sphere, mesh")
    return _primitive(kind, size, place, np.asarray(made.vertices, float), np.asarray(made.faces, int))


def _primitive(kind: str, size: tuple[float, ...], place: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> Shape:
    turned = np.asarray(vertices, float) @ place[:3, :3].T + place[:3, 3]
    return Shape(kind, size, place, turned, np.asarray(faces, int))


def _sizes(path: Path, link: str, values: Any) -> Float[np.ndarray, "n"]:
    found = np.asarray(values, float)
    if not np.isfinite(found).all() or (found <= 0).any():
        raise InputError(f"{path}: link {shown(link)} has a shape of size {found.tolist()}; give metres, more than 0")
    return found


def _mesh(path: Path, link: str, mesh: Any) -> trimesh.Trimesh:
    file = mesh_file(path, mesh.filename)
    if file is None:
        raise AbsentMeshError(
            f"{path}: the mesh {shown(str(mesh.filename))} of link {shown(link)} is not there; put it where the URDF "
            "says, beside the file"
        )
    try:
        loaded = trimesh.load_mesh(file)
    except Exception as error:  # what a damaged file raises is the reader's affair
        hint = "; install pycollada to read .dae" if file.suffix.lower() == ".dae" else ""
        raise InputError(
            f"{path}: the mesh {file} of link {shown(link)} cannot be read ({type(error).__name__}){hint}"
        ) from None
    vertices = np.asarray(loaded.vertices, float)
    if len(loaded.faces) == 0 or not np.isfinite(vertices).all():
        raise InputError(f"{path}: the mesh {file} of link {shown(link)} has no surface; give one with triangles")
    scale = np.ones(3) if mesh.scale is None else np.broadcast_to(np.asarray(mesh.scale, float), 3)
    order = -1 if np.prod(scale) < 0 else 1  # a mirrored mesh would be inside out
    return trimesh.Trimesh(vertices * scale, np.asarray(loaded.faces)[:, ::order], process=False)


def mesh_file(path: Path, name: str) -> Path | None:
    """Where a URDF's mesh is: beside the file, or of a ROS package around it; None where it is not."""
    plain = str(name).removeprefix("file://")
    if plain.startswith("package://"):
        parts = Path(plain.removeprefix("package://")).parts
        places = [folder / Path(*rest) for folder in path.resolve().parents for rest in (parts, parts[1:])]
    else:
        places = [path.parent / plain]
    return next((place for place in places if place.is_file()), None)
