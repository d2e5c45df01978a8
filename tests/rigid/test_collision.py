import numpy as np
import pytest
import trimesh

from mjx_hand.hand.joints import LINKS, TIP_LINKS
from mjx_hand.rigid.collision import segment_distance, surface_distance
from mjx_hand.rigid.segmentation.face_links import face_links
from tests.rigid.conftest import SHAPE


def skin(hand, rigid, link):
    """The vertices of the skin that a link's capsules were fitted to (link frame)."""
    rest = np.asarray(hand.template) + np.asarray(hand.shapedirs)[..., : len(SHAPE)] @ SHAPE
    own = np.unique(np.asarray(hand.faces)[face_links(hand) == link])
    return rest[own] - (np.asarray(hand.joint_regressor) @ rest)[link]


def capsules(rigid, link):
    mine = np.array(rigid.capsule_links) == link
    return rigid.capsule_ends[mine], rigid.capsule_radius[mine]


def test_segment_distance_against_a_search():
    rng = np.random.default_rng(0)
    points, ends = rng.normal(size=(5, 3)), rng.normal(size=(2, 2, 3))
    found = segment_distance(points, ends)
    for i, point in enumerate(points):
        for k, (a, b) in enumerate(ends):
            dense = a + np.linspace(0, 1, 2001)[:, None] * (b - a)
            assert found[i, k] == pytest.approx(np.linalg.norm(dense - point, axis=1).min(), abs=2e-3)


def test_capsules_follow_the_skin(hand, rigid):
    for link in range(1, 16):
        off = np.abs(surface_distance(skin(hand, rigid, link), *capsules(rigid, link)))
        base = LINKS[link].endswith("1")  # skin there runs on into the webs, which are no tube
        assert off.mean() < (3.5e-3 if base else 2e-3)
        assert np.median(off) < (3e-3 if base else 1.5e-3)
    assert (rigid.capsule_radius > 4e-3).all()
    assert (rigid.capsule_radius < 2.5e-2).all()


def test_finger_pads_are_close(rigid):
    """Where grasping happens: the pad, on the palm's side of the last segment, halfway to its tip."""
    for finger, link in enumerate(TIP_LINKS):
        tip = np.asarray(rigid.tip_offset[finger])
        palmar = np.cross(rigid.hinge_axis[4 * finger + 3], tip)
        mesh = trimesh.Trimesh(rigid.mesh_vertices[link], rigid.mesh_faces[link], process=False)
        along = mesh.triangles_center @ tip / (tip @ tip)
        pad = (mesh.face_normals @ palmar > 0.6 * np.linalg.norm(palmar)) & (along > 0.2) & (along < 0.8)
        assert pad.sum() > 8
        assert np.abs(surface_distance(mesh.triangles_center[pad], *capsules(rigid, link))).mean() < 1e-3


def test_palm_is_covered(hand, rigid):
    """The flat of the hand, where objects rest: between the knuckles and the wrist, on the palm's side."""
    points = skin(hand, rigid, 0)
    knuckles = rigid.link_offset[[1, 4, 7, 10]]
    along = points @ knuckles.mean(axis=0) / (knuckles.mean(axis=0) ** 2).sum()
    beside = points[:, 2] < knuckles[0, 2]  # not the thumb's side
    flat = points[(along > 0.2) & (along < 0.9) & (points[:, 1] < 0) & beside]
    off = surface_distance(flat, *capsules(rigid, 0))
    assert len(flat) > 20
    assert np.abs(off).mean() < 3e-3


def test_finger_tips_lie_on_their_capsules(rigid):
    for tip, link in zip(rigid.tip_offset, TIP_LINKS, strict=True):
        off = surface_distance(tip[None], *capsules(rigid, link))
        assert abs(off[0]) < 2.5e-3


def test_consecutive_capsules_meet_at_the_joint(rigid):
    capsule = {link: k for k, link in enumerate(rigid.capsule_links)}
    for link in (1, 2, 4, 5, 7, 8, 10, 11, 13, 14):
        near, far = rigid.capsule_ends[capsule[link]][1], rigid.capsule_ends[capsule[link + 1]][0]
        gap = np.linalg.norm(near - (far + rigid.link_offset[link + 1]))
        assert gap < 0.6 * rigid.capsule_radius[capsule[link + 1]]
