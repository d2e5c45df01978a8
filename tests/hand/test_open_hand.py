import collections

import jax
import numpy as np
import pytest
import trimesh

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, LINKS, PARENTS, TIP_LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.mirror import mirrored
from mjx_hand.hand.open_hand import ASSET, load_open_hand

RIGHT = load_open_hand()
JOINTS = RIGHT.joint_regressor @ RIGHT.template
TIPS = RIGHT.template[RIGHT.tip_vertices]
INDEX, MIDDLE, PINKY, RING, THUMB = (LINKS.index(f"{finger}1") for finger in FINGERS)


def vertices(*beta: float) -> np.ndarray:
    return RIGHT.template + RIGHT.shapedirs @ np.pad(np.array(beta, np.float32), (0, 10 - len(beta)))


def surface(points: np.ndarray) -> trimesh.Trimesh:
    return trimesh.Trimesh(points, RIGHT.faces, process=False)


def hand_length(points: np.ndarray) -> float:
    joints = RIGHT.joint_regressor @ points
    chain = np.vstack([joints[[0, MIDDLE, MIDDLE + 1, MIDDLE + 2]], points[RIGHT.tip_vertices[1]]])
    return float(np.linalg.norm(np.diff(chain, axis=0), axis=1).sum())


def winding_number(point: np.ndarray, points: np.ndarray, faces: np.ndarray) -> float:
    """1 inside, 0 outside: the solid angle that an outward surface spans (van Oosterom and Strackee 1983)."""
    a, b, c = np.moveaxis(points[faces].astype(float) - point, 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return float(2 * np.arctan2(triple, below).sum() / (4 * np.pi))


def test_arrays_have_the_documented_shapes_and_types() -> None:
    v = RIGHT.num_vertices
    assert (v, RIGHT.num_shape, RIGHT.side, RIGHT.name) == (1649, 10, "right", "open hand")
    shapes = {name: np.shape(value) for name, value in vars(RIGHT).items() if isinstance(value, np.ndarray)}
    assert shapes == {
        "template": (v, 3),
        "faces": (3294, 3),
        "weights": (v, 16),
        "shapedirs": (v, 3, 10),
        "posedirs": (v, 3, 135),
        "joint_regressor": (16, v),
        "tip_vertices": (5,),
        "pose_mean": (15, 3),
    }
    floats = (RIGHT.template, RIGHT.weights, RIGHT.shapedirs, RIGHT.posedirs, RIGHT.joint_regressor, RIGHT.pose_mean)
    assert {x.dtype for x in floats} == {np.dtype(np.float32)}
    assert not RIGHT.posedirs.any()
    assert not RIGHT.pose_mean.any()


def test_asset_is_small_enough_for_the_package() -> None:
    assert ASSET.stat().st_size < 250_000


@pytest.mark.parametrize("side", ["right", "left"])
def test_surface_is_one_closed_outward_sphere(side: str) -> None:
    hand = load_open_hand(side)
    mesh = trimesh.Trimesh(hand.template, hand.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 2
    assert mesh.body_count == 1
    assert 250e-6 < mesh.volume < 400e-6  # positive: the faces look outward
    assert mesh.area_faces.min() > 1e-9
    assert set(np.unique(hand.faces)) == set(range(hand.num_vertices))


def test_wrist_cap_faces_the_forearm() -> None:
    normals = surface(RIGHT.template).face_normals[-18:]  # a ring of 20 vertices closes with 18 triangles
    assert (normals[:, 0] > np.cos(np.radians(25))).all()


def test_weights_and_regressor_are_convex() -> None:
    for rows in (RIGHT.weights, RIGHT.joint_regressor):
        assert rows.min() >= 0
        np.testing.assert_allclose(rows.sum(axis=1), 1, atol=1e-6)
    assert ((RIGHT.joint_regressor > 0).sum(axis=1) <= 12).all()
    assert ((RIGHT.weights > 0).sum(axis=1) <= 6).all()


def test_frame_is_manos() -> None:
    """Fingers along -x, back of the hand +y, thumb side +z, the wrist away from the origin."""
    assert (TIPS[:, 0] < JOINTS[0, 0] - 0.08).all()
    across = JOINTS[[INDEX, MIDDLE, RING, PINKY], 2]
    assert (np.diff(across) < -0.01).all()
    assert JOINTS[THUMB, 2] > 0.015
    assert TIPS[4, 2] > TIPS[0, 2] + 0.02  # the thumb's tip lies beside the index finger's
    assert TIPS[4, 1] < -0.01  # and on the palm's side
    assert np.linalg.norm(JOINTS[0]) > 0.03
    palm_depth = JOINTS[MIDDLE, 1] - RIGHT.template[:, 1].min()
    assert palm_depth > RIGHT.template[:, 1].max() - JOINTS[MIDDLE, 1] > 0


def test_bones_form_a_flat_hand_of_human_proportions() -> None:
    length = hand_length(RIGHT.template)
    assert 0.175 < length < 0.200
    for f, finger in enumerate(FINGERS):
        chain = np.vstack([JOINTS[[1 + 3 * f, 2 + 3 * f, 3 + 3 * f]], TIPS[f]])
        bones = np.diff(chain, axis=0)
        lengths = np.linalg.norm(bones, axis=1)
        assert (lengths > 0.012).all()
        assert (lengths < 0.05).all()
        if finger != "thumb":
            slope = np.degrees(np.arcsin(bones[:, 1] / lengths))
            assert (np.abs(slope) < 8).all()  # flat: the tip vertex lies on the skin, not on the bone's axis
            turn = bones[:2] / lengths[:2, None]
            assert turn[0] @ turn[1] > np.cos(np.radians(3))  # straight
            assert lengths[0] > lengths[1]  # the proximal phalanx is the longest
    metacarpal = [np.linalg.norm(JOINTS[k] - JOINTS[0]) for k in (MIDDLE, INDEX, RING, PINKY)]
    assert max(metacarpal) == metacarpal[0]
    assert metacarpal[3] == min(metacarpal)


@pytest.mark.parametrize("beta", [(), (-3,), (3,)])
def test_joints_and_tips_sit_in_and_on_the_hand(beta: tuple[float, ...]) -> None:
    points = vertices(*beta)
    for joint in RIGHT.joint_regressor @ points:
        assert winding_number(joint, points, RIGHT.faces) == pytest.approx(1, abs=1e-3)
    for f, link in enumerate(TIP_LINKS):
        assert RIGHT.weights[RIGHT.tip_vertices[f], link] > 0.9
        joints = RIGHT.joint_regressor @ points
        bone = joints[link] - joints[link - 1]
        own = points[RIGHT.weights.argmax(axis=1) == link]
        reach = (own - joints[link]) @ bone / np.linalg.norm(bone)
        tip = (points[RIGHT.tip_vertices[f]] - joints[link]) @ bone / np.linalg.norm(bone)
        assert tip > reach.max() - 0.003


def test_each_link_owns_one_patch_with_simple_borders() -> None:
    """Rigid segments are cut along these borders: no island, no border that touches itself."""
    owner = RIGHT.weights[RIGHT.faces].sum(axis=1).argmax(axis=1)
    pairs = trimesh.graph.face_adjacency(RIGHT.faces)
    for link in range(16):
        faces = np.flatnonzero(owner == link)
        inside = pairs[(owner[pairs] == link).all(axis=1)]
        assert len(faces) >= 50
        assert len(trimesh.graph.connected_components(inside, nodes=faces)) == 1
        edges = np.sort(RIGHT.faces[faces][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        border = [edge for edge, count in collections.Counter(map(tuple, edges)).items() if count == 1]
        touching = collections.Counter(v for edge in border for v in edge)
        assert set(touching.values()) == {2}
        neighbours = {int(n) for pair in pairs[(owner[pairs] == link).any(axis=1)] for n in owner[pair]} - {link}
        tree = {PARENTS[link]} | {k for k in range(16) if PARENTS[k] == link}
        assert tree - {-1} <= neighbours


@pytest.mark.parametrize("component", range(10))
@pytest.mark.parametrize("amount", [-3.0, 3.0])
def test_extreme_shapes_are_still_hands(component: int, amount: float) -> None:
    beta = np.zeros(10, np.float32)
    beta[component] = amount
    points = vertices(*beta.tolist())
    mesh, mean = surface(points), surface(RIGHT.template)
    assert mesh.is_watertight
    assert 140e-6 < mesh.volume < 600e-6
    assert 0.14 < hand_length(points) < 0.24
    assert np.einsum("ij,ij->i", mesh.face_normals, mean.face_normals).min() > 0  # no face turns over


def test_shape_scores_have_unit_variance_and_falling_importance() -> None:
    spread = np.linalg.norm(RIGHT.shapedirs, axis=(0, 1))
    assert (np.diff(spread) < 0).all()
    assert hand_length(vertices(1)) - hand_length(vertices(-1)) > 0.018  # component 1 is size
    flat = RIGHT.shapedirs.reshape(-1, 10)
    cosines = (flat.T @ flat) / np.outer(spread, spread)
    np.testing.assert_allclose(cosines, np.eye(10), atol=1e-3)


def test_left_is_the_exact_mirror_image() -> None:
    left = load_open_hand("left")
    assert left.side == "left"
    np.testing.assert_array_equal(left.template * np.array([-1, 1, 1], np.float32), RIGHT.template)
    np.testing.assert_array_equal(left.faces[:, ::-1], RIGHT.faces)
    joints = left.joint_regressor @ left.template
    np.testing.assert_allclose(joints * [-1, 1, 1], JOINTS, atol=1e-7)
    shaped = left.template + left.shapedirs @ np.full(10, 0.5, np.float32)
    np.testing.assert_allclose(shaped * [-1, 1, 1], vertices(*[0.5] * 10), atol=1e-7)
    twice = mirrored(left)
    for mine, other in zip(jax.tree.leaves(twice), jax.tree.leaves(RIGHT), strict=True):
        np.testing.assert_array_equal(mine, other)


def test_load_hand_without_a_file_is_the_open_hand() -> None:
    np.testing.assert_array_equal(load_hand().template, RIGHT.template)
    assert load_hand(side="left").side == "left"


@pytest.mark.parametrize("load", [load_open_hand, lambda side: load_hand(side=side)])
def test_unknown_side_is_refused(load) -> None:
    with pytest.raises(InputError, match="'middle'; give 'right' or 'left'"):
        load("middle")
