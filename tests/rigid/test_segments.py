import numpy as np
import pytest
import trimesh

from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.pytree import replace
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.segments import DENSITY, border_loops, cap_outlines, close, cut, face_links
from tests.rigid.conftest import SHAPE


@pytest.fixture(scope="module")
def open_hand():
    return load_hand()


@pytest.mark.parametrize("seed", range(4))
def test_segments_of_random_shapes_are_closed_and_sound(open_hand, seed):
    shape = np.random.default_rng(seed).uniform(-3, 3, open_hand.num_shape)
    rigid = build_rigid_hand(open_hand, shape)
    for vertices, faces in zip(rigid.mesh_vertices, rigid.mesh_faces, strict=True):
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.euler_number == 2
        assert mesh.volume > 0
    # An inertia tensor is that of a real body only if no principal moment exceeds the sum of the others.
    moments = np.linalg.eigvalsh(rigid.link_inertia)
    assert (moments > 0).all()
    assert (moments[:, 2] < moments[:, 0] + moments[:, 1]).all()


def test_masses_sum_to_the_whole_hand(hand, rigid):
    whole = close(np.asarray(hand.faces))
    rest = hand.template + hand.shapedirs[..., : len(SHAPE)] @ SHAPE
    volume = trimesh.Trimesh(whole.vertices(rest), whole.faces, process=False).volume
    np.testing.assert_allclose(rigid.link_mass.sum(), DENSITY * volume, rtol=1e-5)
    assert 0.2 < rigid.link_mass.sum() < 0.7  # a human hand weighs about 0.4 kg


def test_segments_fill_the_hand_without_gap_or_overlap(open_hand):
    rest = open_hand.template.astype(float)
    whole = trimesh.Trimesh(rest, open_hand.faces, process=False)
    assert whole.is_watertight
    parts = [trimesh.Trimesh(piece.vertices(rest), piece.faces, process=False) for piece in cut(open_hand)]
    np.testing.assert_allclose(sum(part.volume for part in parts), whole.volume, rtol=1e-9)


def test_inertia_agrees_with_a_sampled_solid(rigid):
    """Monte Carlo integration over points inside the link, which shares nothing with the surface formula."""
    link = 2
    mesh = trimesh.Trimesh(rigid.mesh_vertices[link], rigid.mesh_faces[link], process=False)
    rng = np.random.default_rng(1)
    points = rng.uniform(mesh.bounds[0], mesh.bounds[1], (4000, 3))
    # Winding number by solid angles: no ray-casting backend needed.
    a, b, c = np.moveaxis(mesh.triangles[None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    triple = (a * np.cross(b, c)).sum(-1)
    below = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    inside = points[np.arctan2(triple, below).sum(-1) > np.pi]
    com = inside.mean(axis=0)
    off = inside - com
    inertia = rigid.link_mass[link] * ((off**2).sum() * np.eye(3) - off.T @ off) / len(inside)
    np.testing.assert_allclose(com, rigid.link_com[link], atol=1e-3)
    np.testing.assert_allclose(inertia, rigid.link_inertia[link], atol=0.06 * np.trace(inertia))


def test_every_link_is_one_patch(open_hand):
    labels = face_links(open_hand)
    assert set(labels.tolist()) == set(range(16))
    pairs = np.asarray(trimesh.graph.face_adjacency(open_hand.faces))
    same = pairs[labels[pairs[:, 0]] == labels[pairs[:, 1]]]
    assert len(trimesh.graph.connected_components(same, nodes=np.arange(len(labels)))) == 16


def test_stray_islands_join_their_surroundings(open_hand):
    # Give one vertex in the middle of the palm to the thumb's tip: its faces would be an island of that link.
    palm = int(np.linalg.norm(open_hand.template - open_hand.template.mean(axis=0), axis=1).argmin())
    weights = np.array(open_hand.weights)
    weights[palm] = 20 * np.eye(16)[15]
    stray = replace(open_hand, weights=weights)
    np.testing.assert_array_equal(face_links(stray), face_links(open_hand))


def test_a_link_without_skin_is_named(open_hand):
    weights = np.array(open_hand.weights)
    weights[:, 3] = 0
    with pytest.raises(InputError, match="index3"):
        face_links(replace(open_hand, weights=weights))


def test_border_loops_split_where_they_touch():
    # Two triangles that share only vertex 0: one boundary that passes it twice.
    loops = border_loops(np.array([[0, 1, 2], [0, 3, 4]]))
    assert sorted(sorted(loop.tolist()) for loop in loops) == [[0, 1, 2], [0, 3, 4]]


def test_outlines_pair_up_across_a_finger_base():
    # A loop that borders segment 7 on the back and on the palm of the hand, with 8 and 9 to either side.
    outlines = cap_outlines(list(range(8)), [7, 7, 8, 8, 7, 7, 9, 9], set())
    assert sorted(sorted(outline.tolist()) for outline in outlines) == [[0, 1, 2, 4, 5, 6], [0, 6, 7], [2, 3, 4]]


def test_a_chord_that_would_double_a_skin_edge_is_not_drawn():
    outlines = cap_outlines(list(range(4)), [7, 7, 8, 8], {(0, 2)})
    assert [sorted(outline.tolist()) for outline in outlines] == [[0, 1, 2, 3]]
