import numpy as np
import pytest
import trimesh

from mjx_hand.hand.joints import TIP_LINKS
from mjx_hand.rigid.collision import segment_distance, surface_distance


def skin(rigid, link, count=400):
    """Points on a link's mesh, spread by area (link frame)."""
    mesh = trimesh.Trimesh(rigid.mesh_vertices[link], rigid.mesh_faces[link], process=False)
    return trimesh.sample.sample_surface(mesh, count, seed=0)[0]


def test_segment_distance_against_a_search():
    rng = np.random.default_rng(0)
    points, ends = rng.normal(size=(5, 3)), rng.normal(size=(2, 2, 3))
    found = segment_distance(points, ends)
    for i, point in enumerate(points):
        for k, (a, b) in enumerate(ends):
            dense = a + np.linspace(0, 1, 2001)[:, None] * (b - a)
            assert found[i, k] == pytest.approx(np.linalg.norm(dense - point, axis=1).min(), abs=2e-3)


def test_capsules_follow_the_skin(rigid):
    links = np.array(rigid.capsule_links)
    for link in range(1, 16):
        mine = links == link
        off = surface_distance(skin(rigid, link), rigid.capsule_ends[mine], rigid.capsule_radius[mine])
        # Caps inside the finger are sampled too: they count as inside, so only look at the skin's own error.
        assert np.quantile(off, 0.98) < 3e-3
        assert np.median(np.abs(off)) < 2e-3
    assert (rigid.capsule_radius > 4e-3).all()
    assert (rigid.capsule_radius < 2.5e-2).all()


def test_finger_tips_lie_on_their_capsules(rigid):
    links = np.array(rigid.capsule_links)
    for tip, link in zip(rigid.tip_offset, TIP_LINKS, strict=True):
        mine = links == link
        off = surface_distance(tip[None], rigid.capsule_ends[mine], rigid.capsule_radius[mine])
        assert abs(off[0]) < 2.5e-3


def test_consecutive_capsules_meet_at_the_joint(rigid):
    capsule = {link: k for k, link in enumerate(rigid.capsule_links)}
    for link in (1, 2, 4, 5, 7, 8, 10, 11, 13, 14):
        near, far = rigid.capsule_ends[capsule[link]][1], rigid.capsule_ends[capsule[link + 1]][0]
        gap = np.linalg.norm(near - (far + rigid.link_offset[link + 1]))
        assert gap < 0.6 * rigid.capsule_radius[capsule[link + 1]]
