"""A mesh as convex pieces, from its decomposition to the physics that runs on it."""

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
import trimesh

from envs.scene import OBJECT, scene_spec
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.objects.convex_decomposition import convex_pieces
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.primitives import hull_planes, signed_distance
from mjx_hand.objects.surface_points import surface_points
from mjx_hand.rigid.build import build_rigid_hand

# An angle of two boards: convex pieces must leave its corner empty, one hull would fill it.
LONG = trimesh.creation.box(extents=(0.12, 0.03, 0.03))
SHORT = trimesh.creation.box(
    extents=(0.03, 0.03, 0.06), transform=trimesh.transformations.translation_matrix((0.045, 0, 0.045))
)


@pytest.fixture(scope="module")
def angle() -> trimesh.Trimesh:
    return trimesh.Trimesh(*_joined())


def _joined() -> tuple[np.ndarray, np.ndarray]:
    """One closed surface around both boards: an L in the xz plane, extruded along y."""
    outline = np.array([[-6, -1.5], [6, -1.5], [6, 7.5], [3, 7.5], [3, 1.5], [-6, 1.5]]) / 100
    triangles = np.array([[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4]])
    front, back = (np.insert(outline, 1, y, axis=1) for y in (-0.015, 0.015))
    side = [[k, (k + 1) % 6, 6 + k] for k in range(6)] + [[(k + 1) % 6, 6 + (k + 1) % 6, 6 + k] for k in range(6)]
    faces = np.concatenate([triangles, 6 + triangles[:, ::-1], np.array(side)[:, ::-1]])
    return np.concatenate([front, back]), faces


@pytest.fixture(scope="module")
def hulls(angle):
    return convex_pieces(np.asarray(angle.vertices), np.asarray(angle.faces))


@pytest.fixture(scope="module")
def described(hulls):
    return ObjectDescription(kind="mesh", size=np.abs(hulls).max(axis=(0, 1)), mass=0.2, friction=0.9, hulls=hulls)


def in_boards(points: np.ndarray) -> np.ndarray:
    return np.maximum(*(np.array([trimesh.proximity.signed_distance(b, points) for b in (LONG, SHORT)])))


def test_the_pieces_fill_the_mesh_and_leave_its_corner_empty(hulls):
    assert 2 <= len(hulls) <= 4
    planes = hull_planes(hulls)
    points = np.random.default_rng(0).uniform((-0.07, -0.02, -0.02), (0.07, 0.02, 0.08), (400, 3))
    depth = in_boards(points)  # positive inside
    found = np.asarray(signed_distance("mesh", jnp.ones(3), jnp.asarray(points), planes))
    clear = np.abs(depth) > 0.002
    np.testing.assert_array_equal(found[clear] < 0, depth[clear] > 0)
    assert (found[depth < -0.002] <= -depth[depth < -0.002] + 0.002).all()  # never more than the true distance
    assert found[np.argmax(depth)] == pytest.approx(-depth.max(), abs=0.002)


def test_decomposition_is_the_same_every_time(angle, hulls):
    np.testing.assert_array_equal(convex_pieces(np.asarray(angle.vertices), np.asarray(angle.faces)), hulls)


def test_surface_points_lie_on_the_outside_alone(described, angle):
    points = surface_points(described, 1000)
    assert points.shape == (1000, 3)
    assert trimesh.proximity.closest_point(angle, points)[1].max() < 0.001
    np.testing.assert_allclose(
        points.mean(axis=0), angle.triangles_center.T @ angle.area_faces / angle.area, atol=0.004
    )


def test_physics_has_its_mass_and_its_shape(described):
    model = load_hand()
    hand = build_rigid_hand(model, np.zeros(model.num_shape))
    scene = scene_spec(hand, described, np.zeros((0, 3)), np.zeros((0, 3)), np.eye(3)).compile()
    body = scene.body(OBJECT)
    whole = trimesh.Trimesh(*_joined())
    assert body.mass[0] == pytest.approx(0.2)
    np.testing.assert_allclose(body.ipos, whole.center_mass, atol=1e-3)
    data = mujoco.MjData(scene)
    data.qpos[2], data.ctrl[2] = 0.5, 0.5  # the hand is elsewhere
    data.qpos[-7:] = [0.0, 0.0, 0.0152, 1.0, 0.0, 0.0, 0.0]
    for _ in range(250):
        mujoco.mj_step(scene, data)
    assert data.qpos[-5] == pytest.approx(0.015, abs=1e-3)  # it lies on its long board


def test_bad_meshes_are_refused():
    vertices, faces = _joined()
    with pytest.raises(InputError, match="NaN or infinite"):
        convex_pieces(np.where(np.arange(len(vertices))[:, None] == 3, np.nan, vertices), faces)
    with pytest.raises(InputError, match="faces over 12 vertices that do not fit"):
        convex_pieces(vertices, faces + 1)
    with pytest.raises(InputError, match="flat"):
        convex_pieces(vertices * [1, 0, 1], faces)
