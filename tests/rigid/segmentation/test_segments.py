"""The hand cut into segments, at random shapes of both sides."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import PARENTS
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.model import HandModel
from mjx_hand.pytree import replace
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.rigid.segmentation.isocurves import link_pull, patches
from mjx_hand.rigid.segmentation.segments import DENSITY, cut

HANDS = {side: load_hand(side=side) for side in ("right", "left")}
SHAPES = st.lists(st.floats(-3, 3), min_size=10, max_size=10)


def rest(hand: HandModel, shape: list[float]) -> np.ndarray:
    return np.asarray(hand.template + hand.shapedirs @ np.array(shape, np.float32), float)


def winding_number(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """1 inside, 0 outside: the solid angle that an outward surface spans (van Oosterom and Strackee 1983)."""
    a, b, c = np.moveaxis(vertices[faces][None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    triple = (a * np.cross(b, c)).sum(-1)
    below = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    return 2 * np.arctan2(triple, below).sum(-1) / (4 * np.pi)


def distance_to(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    corners = vertices[faces]
    nearest = [trimesh.triangles.closest_point(corners, np.tile(p, (len(faces), 1))) for p in points]
    return np.array([np.linalg.norm(near - p, axis=1).min() for near, p in zip(nearest, points, strict=True)])


def assert_segments_are_closed(rigid: RigidHand) -> None:
    for vertices, faces in zip(rigid.mesh_vertices, rigid.mesh_faces, strict=True):
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.euler_number == 2
        assert mesh.volume > 0


@pytest.mark.parametrize("side", ["right", "left"])
@settings(deadline=None, max_examples=10)
@given(shape=SHAPES)
def test_any_shape_within_three_deviations_is_a_sound_body(side: str, shape: list[float]) -> None:
    hand = HANDS[side]
    rigid = build_rigid_hand(hand, shape)
    assert_segments_are_closed(rigid)
    # An inertia tensor is that of a real body only if no principal moment exceeds the sum of the others.
    moments = np.linalg.eigvalsh(rigid.link_inertia)
    assert (moments > 0).all()
    assert (moments[:, 2] < moments[:, 0] + moments[:, 1]).all()
    skin = rest(hand, shape)
    np.testing.assert_allclose(
        rigid.link_mass.sum(), DENSITY * trimesh.Trimesh(skin, hand.faces, process=False).volume, rtol=1e-5
    )
    # Every link's share of the mass is its own size's, nowhere near another's.
    assert (rigid.link_mass / rigid.link_mass.sum() > 0.0025).all()
    assert 0.4 < rigid.link_mass[0] / rigid.link_mass.sum() < 0.75
    # Capsules: of a finger's thickness, their surface nowhere far outside the skin.
    assert (rigid.capsule_radius > 3e-3).all()
    assert (rigid.capsule_radius < 3.5e-2).all()
    links = list(rigid.capsule_links)
    centres = np.asarray(hand.joint_regressor, float) @ skin
    ends = np.asarray(rigid.capsule_ends) + centres[links][:, None]
    along = np.linspace(0, 1, 4)[:, None, None]
    axis = (ends[:, 0] + along * (ends[:, 1] - ends[:, 0])).reshape(-1, 3)  # on the capsules' axes, (4 c, 3)
    assert (winding_number(axis, skin, hand.faces) > 0.5).all()
    depth, _ = KDTree(skin).query(axis)
    assert (depth > 0.2 * np.tile(rigid.capsule_radius, 4)).all()
    assert np.median(depth / np.tile(rigid.capsule_radius, 4)) > 0.7


@pytest.mark.parametrize("side", ["right", "left"])
@settings(deadline=None, max_examples=5)
@given(shape=SHAPES)
def test_drawn_at_rest_the_segments_are_the_skin_and_nothing_sticks_out(side: str, shape: list[float]) -> None:
    hand = HANDS[side]
    parts, skin = cut(hand), rest(hand, shape)
    divided = parts.skin.vertices(skin)
    centres = np.asarray(hand.joint_regressor, float) @ skin
    area = 0.0
    for segment in parts.segments:
        vertices, faces = segment.surface(divided, centres)
        own = segment.shell.num_skin_faces
        area += trimesh.triangles.area(vertices[faces[:own]]).sum()
        caps = vertices[len(segment.shell.vertex_ids) :]
        outside = caps[::5][winding_number(caps[::5], skin, hand.faces) < 0.5]
        assert len(outside) <= 2
        assert (distance_to(outside, skin, hand.faces) < 5e-4).all()
    # The segments' skin is the whole skin, each piece of it once.
    np.testing.assert_allclose(area, trimesh.triangles.area(skin[hand.faces]).sum(), rtol=1e-9)
    np.testing.assert_array_equal(divided[: len(skin)], skin)


@pytest.mark.parametrize("side", ["right", "left"])
def test_solids_fill_the_hand_without_gap_or_overlap(side: str) -> None:
    hand = HANDS[side]
    skin = rest(hand, [0.0] * 10)
    parts = cut(hand)
    divided = parts.skin.vertices(skin)
    solids = [trimesh.Trimesh(s.solid.vertices(divided), s.solid.faces, process=False) for s in parts.segments]
    assert all(solid.is_watertight for solid in solids)
    whole = trimesh.Trimesh(skin, hand.faces, process=False).volume
    np.testing.assert_allclose(sum(solid.volume for solid in solids), whole, rtol=1e-9)


def test_a_joint_that_bends_opens_no_gap() -> None:
    """Behind the back of each finger's border, where a gap would open, lies the segment's own dome."""
    hand = HANDS["right"]
    rigid = build_rigid_hand(hand)
    for hinge, link in ((1, 1), (2, 2), (3, 3), (5, 4), (6, 5), (9, 7), (13, 10), (14, 11)):
        vertices, faces = rigid.mesh_vertices[link], rigid.mesh_faces[link]
        skin_ids = cut(hand).segments[link].shell.vertex_ids
        near = vertices[: len(skin_ids)]
        axis = np.asarray(rigid.hinge_axis[hinge])
        bone = np.asarray(rigid.link_offset[link + 1] if link % 3 else rigid.tip_offset[(link - 1) // 3])
        forward = bone / np.linalg.norm(bone)
        back = np.cross(forward, axis)
        back *= np.sign(back[1])  # towards the back of the hand
        # Skin of the back, right at the joint: how far from it the knuckle's surface should stay as it turns.
        reach = near @ back
        knuckle = reach[np.abs(near @ forward) < 4e-3].max()
        for turn in np.deg2rad([20, 40, 60]):
            way = np.cos(turn) * back - np.sin(turn) * forward
            points = np.linspace(0, 1, 60)[:, None] * knuckle * 1.3 * way
            inside = winding_number(points, vertices, faces) > 0.5
            assert points[inside] @ way > 0.0 if not inside.any() else (points[inside] @ way).max() > 0.7 * knuckle


def test_a_border_separates_what_each_link_pulls_most() -> None:
    hand = HANDS["right"]
    skin, pull = patches(hand), link_pull(hand)
    np.testing.assert_allclose(pull.sum(axis=1), 1, atol=1e-9)
    assert (pull > -1e-12).all()
    assert (pull.argmax(axis=1) == skin.vertex_links).mean() > 0.995  # but for the palm's rim and islands
    # Each link holds what follows it alone.
    alone = np.asarray(hand.weights).max(axis=1) > 0.99
    assert (np.asarray(hand.weights).argmax(axis=1) == skin.vertex_links)[alone].mean() > 0.97
    assert set(skin.face_links.tolist()) == set(range(16))


def test_borders_have_no_teeth() -> None:
    """Around the base of the thumb, where triangles are large, and all others that do not run through two webs."""
    hand = HANDS["right"]
    parts = cut(hand)
    divided = parts.skin.vertices(rest(hand, [0.0] * 10))
    for link in set(range(1, 16)) - {4, 7, 10}:
        border = next(border for border, joint, _ in parts.segments[link].domes if joint == link)
        points = divided[parts.segments[link].shell.vertex_ids[border]]
        way = np.roll(points, -1, axis=0) - points
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        turns = np.rad2deg(np.arccos(np.clip((way * np.roll(way, 1, axis=0)).sum(axis=1), -1, 1)))
        assert turns.max() < 75
        assert turns.sum() < 750  # 360 would be a circle


def test_only_base_phalanges_touch_the_palm() -> None:
    for hand in HANDS.values():
        skin = patches(hand)
        edges = hand.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        a, b = skin.vertex_links[edges].T
        assert set(a[b == 0].tolist()) == {0, 1, 4, 7, 10, 13}


def test_a_neighbour_that_turns_away_leaves_no_hollow() -> None:
    """Each segment reaches into the links that it carries, by a good part of its border's width."""
    for hand in HANDS.values():
        parts = cut(hand)
        skin = rest(hand, [0.0] * 10)
        divided, centres = parts.skin.vertices(skin), np.asarray(hand.joint_regressor, float) @ skin
        for link, segment in enumerate(parts.segments):
            joints = [joint for _, joint, _ in segment.domes]
            assert sorted(joints) == [k for k in range(1, 16) if k == link or PARENTS[k] == link]
            drawn = trimesh.Trimesh(*segment.surface(divided, centres), process=False)
            solid = trimesh.Trimesh(segment.solid.vertices(divided), segment.solid.faces, process=False)
            assert drawn.volume > 1.05 * solid.volume


def test_every_link_is_one_patch() -> None:
    skin = patches(HANDS["right"])
    pairs = np.asarray(trimesh.graph.face_adjacency(skin.faces))
    same = pairs[skin.face_links[pairs[:, 0]] == skin.face_links[pairs[:, 1]]]
    assert len(trimesh.graph.connected_components(same, nodes=np.arange(len(skin.faces)))) == 16


def stray_palm_vertex(weight: float) -> HandModel:
    """The open hand with one vertex in the middle of the palm that follows the thumb's tip."""
    hand = HANDS["right"]
    palm = int(np.linalg.norm(hand.template - hand.template.mean(axis=0), axis=1).argmin())
    weights = np.array(hand.weights)
    weights[palm] = weight * np.eye(16)[15]
    return replace(hand, weights=weights)


def test_stray_islands_join_their_surroundings() -> None:
    stray = patches(stray_palm_vertex(200.0))
    np.testing.assert_array_equal(stray.vertex_links, patches(HANDS["right"]).vertex_links)


def test_a_link_without_skin_is_named() -> None:
    weights = np.array(HANDS["right"].weights)
    weights[:, 3] = 0
    with pytest.raises(InputError, match="no skin follows index3"):
        cut(replace(HANDS["right"], weights=weights))


def test_a_joint_outside_the_skin_is_named() -> None:
    regressor = np.array(HANDS["right"].joint_regressor)
    regressor[6] *= 3
    with pytest.raises(InputError, match="joint of middle3 lies outside the skin"):
        cut(replace(HANDS["right"], joint_regressor=regressor))


def test_a_mesh_in_two_parts_is_refused() -> None:
    hand = HANDS["right"]
    faces = np.concatenate([hand.faces, hand.faces.max() + 1 + np.arange(3, dtype=np.int32)[None]])
    names = ("template", "weights", "shapedirs", "posedirs")
    more = {name: np.concatenate([getattr(hand, name), getattr(hand, name)[:3]]) for name in names}
    regressor = np.concatenate([hand.joint_regressor, np.zeros((16, 3), np.float32)], axis=1)
    with pytest.raises(InputError, match="separate parts"):
        cut(replace(hand, faces=faces, joint_regressor=regressor, **more))


def test_a_face_turned_over_is_refused() -> None:
    faces = np.array(HANDS["right"].faces)
    faces[1000] = faces[1000][::-1]
    with pytest.raises(InputError, match="do not all look outward"):
        cut(replace(HANDS["right"], faces=faces))


def test_a_hole_at_the_wrist_is_closed() -> None:
    """MANO's own mesh ends in an open wrist."""
    hand = HANDS["right"]
    opened = replace(hand, faces=np.asarray(hand.faces)[:-18])
    assert not trimesh.Trimesh(hand.template, opened.faces, process=False).is_watertight
    rigid = build_rigid_hand(opened)
    assert_segments_are_closed(rigid)
    np.testing.assert_allclose(rigid.link_mass, build_rigid_hand(hand).link_mass, rtol=0.03)


def test_inertia_agrees_with_a_sampled_solid() -> None:
    """Monte Carlo integration over points inside the link, which shares nothing with the surface formula."""
    hand, link = HANDS["right"], 2
    rigid = build_rigid_hand(hand)
    parts = cut(hand)
    solid = parts.segments[link].solid
    vertices = solid.vertices(parts.skin.vertices(rest(hand, [0.0] * 10)))
    mesh = trimesh.Trimesh(vertices - rigid.wrist_position - rigid.link_offset[:3].sum(axis=0), solid.faces)
    rng = np.random.default_rng(1)
    points = rng.uniform(mesh.bounds[0], mesh.bounds[1], (4000, 3))
    inside = points[winding_number(points, mesh.vertices, mesh.faces) > 0.5]
    com = inside.mean(axis=0)
    off = inside - com
    inertia = rigid.link_mass[link] * ((off**2).sum() * np.eye(3) - off.T @ off) / len(inside)
    np.testing.assert_allclose(com, rigid.link_com[link], atol=1e-3)
    np.testing.assert_allclose(inertia, rigid.link_inertia[link], atol=0.06 * np.trace(inertia))
