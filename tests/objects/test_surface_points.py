import numpy as np
import pytest
import trimesh

from mjx_hand.errors import InputError
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.surface_points import surface_points

MESHES = {
    "box": lambda s: trimesh.creation.box(extents=2 * s),
    "sphere": lambda s: trimesh.creation.icosphere(subdivisions=5, radius=s[0]),
    "cylinder": lambda s: trimesh.creation.cylinder(radius=s[0], height=2 * s[1], sections=256),
    "capsule": lambda s: trimesh.creation.capsule(2 * s[1], s[0], count=(64, 64)),
}


def described(kind: str, size: tuple[float, float, float]) -> ObjectDescription:
    return ObjectDescription(kind=kind, size=np.array(size), mass=0.1, friction=0.9)


CASES = [
    ("box", (0.02, 0.03, 0.1)),
    ("sphere", (0.03, 0.0, 0.0)),
    ("cylinder", (0.03, 0.08, 0.0)),
    ("cylinder", (0.1, 0.01, 0.0)),
    ("capsule", (0.03, 0.05, 0.0)),
]


@pytest.mark.parametrize(("kind", "size"), CASES)
def test_points_lie_on_the_surface_and_spread_evenly(kind, size):
    points = surface_points(described(kind, size), 2000)
    mesh = MESHES[kind](np.array(size))
    scale = max(size)
    off = trimesh.proximity.closest_point(mesh, points)[1]
    assert off.max() < 4e-3 * scale  # the round meshes are polyhedra
    # Even spread: first and second moments are those of the mesh's surface, by its triangles.
    centres, areas = mesh.subdivide().subdivide().triangles_center, mesh.subdivide().subdivide().area_faces
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=0.01 * scale)
    second = np.einsum("f,fi,fj->ij", areas, centres, centres) / areas.sum()
    np.testing.assert_allclose(points.T @ points / len(points), second, atol=0.02 * scale**2)


@pytest.mark.parametrize(("kind", "size"), CASES)
def test_points_are_the_same_every_time(kind, size):
    np.testing.assert_array_equal(surface_points(described(kind, size)), surface_points(described(kind, size)))
    assert surface_points(described(kind, size)).shape == (500, 3)


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="object kind 'cone' is not known; valid: box, sphere, cylinder"):
        surface_points(described("cone", (1.0, 1.0, 1.0)))
    with pytest.raises(InputError, match="count is 0"):
        surface_points(described("box", (1.0, 1.0, 1.0)), 0)
