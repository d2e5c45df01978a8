import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from scipy.optimize import minimize

from mjx_hand.errors import InputError
from mjx_hand.objects.primitives import face_along, half_extents, signed_distance

SIZES = {
    "box": (0.02, 0.03, 0.015),
    "sphere": (0.025, 0.0, 0.0),
    "cylinder": (0.02, 0.04, 0.0),
    "capsule": (0.02, 0.04, 0.0),
}


def nearest(kind, size, x):
    """The solid's closest point to x, by a solver that knows the solid as inequalities (centimetres: it likes ones)."""
    x, size = np.asarray(x, float) * 100, np.asarray(size) * 100
    inside = {
        "box": lambda p: size - np.abs(p),
        "sphere": lambda p: size[0] ** 2 - p @ p,
        "cylinder": lambda p: np.array([size[0] ** 2 - p[0] ** 2 - p[1] ** 2, size[1] - abs(p[2])]),
        "capsule": lambda p: size[0] ** 2 - p[0] ** 2 - p[1] ** 2 - max(abs(p[2]) - size[1], 0) ** 2,
    }[kind]
    limits = {"type": "ineq", "fun": inside}
    return minimize(lambda p: np.sum((p - x) ** 2), x * 0.1, constraints=[limits], options={"ftol": 1e-12}).x / 100


@pytest.mark.parametrize("kind", SIZES)
def test_outside_it_is_the_distance_to_the_nearest_point_that_a_solver_finds(kind):
    size = SIZES[kind]
    points = np.random.default_rng(0).normal(scale=0.05, size=(40, 3))
    distance = np.asarray(signed_distance(kind, jnp.array(size), jnp.asarray(points)))
    outside = distance > 0.002
    assert outside.sum() > 10
    closest = np.stack([nearest(kind, size, x) for x in points[outside]])
    np.testing.assert_allclose(distance[outside], np.linalg.norm(points[outside] - closest, axis=1), atol=2e-5)


@pytest.mark.parametrize("kind", SIZES)
def test_inside_it_is_what_a_fine_mesh_has(kind):
    size = SIZES[kind]
    mesh = {
        "box": lambda: trimesh.creation.box(2 * np.array(size)),
        "sphere": lambda: trimesh.creation.icosphere(5, size[0]),
        "cylinder": lambda: trimesh.creation.cylinder(size[0], 2 * size[1], sections=512),
        "capsule": lambda: trimesh.creation.capsule(2 * size[1], size[0], count=(256, 256)),
    }[kind]()
    points = np.random.default_rng(1).uniform(-1, 1, (200, 3)) * np.asarray(half_extents(kind, jnp.array(size))) * 0.9
    distance = np.asarray(signed_distance(kind, jnp.array(size), jnp.asarray(points)))
    points, distance = points[distance < -1e-4], distance[distance < -1e-4]
    assert len(points) > 50
    planes = mesh.triangles[:, 0] - points[:, None]
    depth = np.einsum("pfc,fc->pf", planes, mesh.face_normals).min(axis=1)  # a convex solid: distance to its planes
    np.testing.assert_allclose(-distance, depth, atol=3e-5)


@pytest.mark.parametrize("kind", SIZES)
def test_the_gradient_is_that_of_finite_differences(kind):
    size, step = jnp.array(SIZES[kind]), 1e-3
    points = jnp.asarray(np.random.default_rng(2).normal(scale=0.05, size=(30, 3)))

    def one(x):
        return signed_distance(kind, size, x)

    gradient = jax.vmap(jax.grad(one))(points)
    ways = step * jnp.eye(3)
    moved = [signed_distance(kind, size, points + way) - signed_distance(kind, size, points - way) for way in ways]
    smooth = np.abs(np.stack(moved, 1) / (2 * step) - np.asarray(gradient)).max(axis=1) < 0.02
    assert smooth.mean() > 0.8  # edges and medial surfaces lie between a few of the stencils
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0, atol=1e-3)
    assert np.isfinite(np.asarray(jax.grad(one)(jnp.zeros(3)))).all()


@pytest.mark.parametrize(
    ("kind", "wanted"),
    [
        ("box", (0.02, 0.03, 0.015)),
        ("sphere", (0.025,) * 3),
        ("cylinder", (0.02, 0.02, 0.04)),
        ("capsule", (0.02, 0.02, 0.06)),
    ],
)
def test_half_extents_bound_the_body(kind, wanted):
    np.testing.assert_allclose(half_extents(kind, jnp.array(SIZES[kind])), wanted, rtol=1e-6)


def test_an_unknown_kind_is_refused():
    with pytest.raises(InputError, match=r"'cone' is not known; valid: box, sphere, cylinder, capsule"):
        signed_distance("cone", jnp.ones(3), jnp.zeros(3))


def test_a_mesh_without_planes_is_told_what_it_needs():
    with pytest.raises(InputError, match=r"a mesh needs the planes of its convex pieces: planes=hull_planes\("):
        signed_distance("mesh", jnp.ones(3), jnp.zeros(3))


@pytest.mark.parametrize(
    ("kind", "size", "normal"),
    [
        ("box", (0.02, 0.03, 0.04), (0.0, -1.0, 0.0)),
        ("sphere", (0.02, 0.0, 0.0), (0.48, 0.6, -0.64)),
        ("cylinder", (0.02, 0.05, 0.0), (0.6, -0.8, 0.0)),
        ("cylinder", (0.02, 0.05, 0.0), (0.0, 0.0, -1.0)),
        ("capsule", (0.02, 0.05, 0.0), (0.6, 0.8, 0.0)),
        ("capsule", (0.02, 0.05, 0.0), (0.0, 0.0, 1.0)),
    ],
)
def test_what_is_touched_along_a_direction_is_on_the_surface_and_faces_it(kind, size, normal):
    size, normal = jnp.array(size), jnp.array(normal)
    place, outwards = face_along(kind, size, normal, jnp.zeros(3), np.zeros((0, 0, 4)))
    np.testing.assert_allclose(signed_distance(kind, size, place), 0.0, atol=1e-6)
    np.testing.assert_array_equal(outwards, normal)
    beyond = place + 0.01 * normal
    np.testing.assert_allclose(jax.grad(lambda p: signed_distance(kind, size, p))(beyond), normal, atol=1e-5)
