"""Meshes of objects from files: `.stl`, `.obj`, `.ply`, `.glb`, `.off` and what else trimesh reads."""

from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float, Int

from mjx_hand.errors import InputError
from mjx_hand.files.digests import file_digest
from mjx_hand.objects.convex_decomposition import convex_pieces
from mjx_hand.objects.description import ObjectDescription

_EXTENT = (0.005, 1.0)  # m: what one hand holds is neither shorter along every axis nor longer along one
_MOST_FACES = 200_000  # convex decomposition of more takes minutes, and its pieces are no better
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}  # of a mesh file, which says none, in metres


def read_mesh(path: str | Path) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Vertices (m) and triangles of a mesh file; of a scene of several meshes, all of them.

    Raises:
        InputError: no such file, no mesh, or one without a surface.
    """
    if not Path(path).is_file():
        raise InputError(f"{path}: no such file; give an object's mesh, .stl, .obj, .ply or .glb, in metres")
    try:
        surface = trimesh.load_mesh(path)
        vertices, faces = np.asarray(surface.vertices, float), np.asarray(surface.faces, int)
    except Exception as error:  # what a damaged file raises is the reader's affair
        raise InputError(
            f"{path}: not a readable mesh ({type(error).__name__}); give .stl, .obj, .ply or .glb"
        ) from None
    if len(faces) == 0 or not np.isfinite(vertices).all():
        raise InputError(f"{path}: holds no surface of finite vertices; give the object's mesh, in metres")
    return vertices, faces


def mesh_digest(path: str | Path) -> str:
    """A digest of the file's content, by which results that were made of it are known.

    Raises:
        InputError: it cannot be read.
    """
    try:
        return file_digest(Path(path))
    except OSError as error:
        raise InputError(
            f"{path}: {error.strerror}; give an object's mesh, .stl, .obj, .ply or .glb, in metres"
        ) from None


def read_object_mesh(path: str | Path, unit: str = "m") -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Vertices (m) and triangles of a mesh file, if they are of something that a hand holds.

    Args:
        path: of the mesh.
        unit: of its numbers: m, cm, mm or in.

    Raises:
        InputError: as `read_mesh`; a unit that is not known; a size that no hand holds, or far too many triangles.
    """
    if unit not in UNITS:
        raise InputError(f"{path}: unit {unit!r} is not known; valid: {', '.join(UNITS)}")
    vertices, faces = read_mesh(path)
    vertices = vertices * UNITS[unit]
    check_object_size(str(path), vertices, faces)
    return vertices, faces


def check_object_size(name: str, vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]) -> None:
    """Check that a mesh (m) is of something that a hand holds.

    Raises:
        InputError: it is too long or too short for that, or has far too many triangles.
    """
    longest = float(np.ptp(vertices, axis=0).max())
    if not _EXTENT[0] <= longest <= _EXTENT[1]:
        guess = longest / 1000
        hint = " (in millimetres? scale it by 0.001)" if _EXTENT[0] <= guess <= _EXTENT[1] else ""
        raise InputError(
            f"{name}: {longest:.4g} m long, but an object in a hand is {_EXTENT[0]:g} to {_EXTENT[1]:g} m{hint}"
        )
    if len(faces) > _MOST_FACES:
        raise InputError(
            f"{name}: {len(faces):,} triangles; at most {_MOST_FACES:,} are taken: simplify the mesh first "
            "(trimesh's simplify_quadric_decimation, MeshLab, Blender's Decimate)"
        )


def object_from_mesh(
    path: str | Path, *, mass: float | None = None, density: float | None = None, friction: float = 0.9
) -> ObjectDescription:
    """An object of a mesh file, its frame moved to the middle of its bounding box, cut into convex pieces.

    Args:
        path: the mesh, in metres.
        mass: kg.
        density: kg/m³, in place of the mass: that of the volume which the surface encloses.
        friction: sliding coefficient.

    Raises:
        InputError: as `read_object_mesh`; both or neither of mass and density, or one that is not positive; a density
            for a surface that encloses no volume.
    """
    if (mass is None) == (density is None):
        raise InputError(f"{path}: mass is {mass} and density {density}; give one of them, in kg or kg/m³")
    if not (mass or density or 0) > 0:
        raise InputError(f"{path}: mass is {mass} and density {density}; the one given must be positive")
    vertices, faces = read_object_mesh(path)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    if density is not None:
        surface = trimesh.Trimesh(vertices, faces)
        if not surface.is_watertight or surface.volume <= 0:
            raise InputError(
                f"{path}: the surface is not closed, so that it has no volume to take the density of; give the mass"
            )
        mass = density * float(surface.volume)
    middle = (low + high) / 2
    return ObjectDescription(
        size=(high - low) / 2,
        mass=float(mass or 0),
        friction=friction,
        hulls=convex_pieces(vertices - middle, faces),
        kind="mesh",
    )
