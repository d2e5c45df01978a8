"""Rigid links against blended skin: what is measured, and that the cut keeps it small."""

import jax.numpy as jnp
import numpy as np

from mjx_hand.capture.load import load_motion
from mjx_hand.hand.joints import HINGES, PARENTS
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.skinning import skin
from mjx_hand.projection import project
from mjx_hand.pytree import replace
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.postures import postures
from mjx_hand.rigid.rigid_hand import joint_rotations
from mjx_hand.rigid.segmentation.segments import cut
from mjx_hand.rigid.skin_error import posed_skins
from tests.rigid.conftest import SHAPE


def errors(hand, shape, rigid, angles) -> np.ndarray:
    hard, soft = posed_skins(hand, shape, rigid, angles)
    return np.linalg.norm(hard - soft, axis=-1)


def test_at_rest_there_is_none(hand, rigid):
    assert errors(hand, SHAPE, rigid, np.zeros((1, 20))).max() < 1e-6


def test_skin_that_follows_one_link_alone_has_none(hand, rigid, angles):
    found = errors(hand, SHAPE, rigid, angles)
    alone = np.asarray(hand.weights).max(axis=1) > 0.9999
    assert alone.sum() > 100
    assert found[:, alone].max() < 1e-5


def test_vertices_move_with_their_own_link_by_the_chain_of_joint_rotations(hand, rigid, angles):
    hard, _ = posed_skins(hand, SHAPE, rigid, angles)
    rest = np.asarray(hand.template) + np.asarray(hand.shapedirs)[..., : len(SHAPE)] @ SHAPE
    centres = np.asarray(hand.joint_regressor) @ rest
    turns = np.asarray(joint_rotations(angles, rigid))
    owner = cut(hand).skin.vertex_links
    for vertex in range(0, hand.num_vertices, 97):
        point, link = rest[vertex][None], int(owner[vertex])
        while link:  # from the link inwards to the wrist
            point = (point - centres[link])[:, None] @ np.swapaxes(turns[:, link - 1], -1, -2)
            point = point[:, 0] + centres[link]
            link = PARENTS[link]
        np.testing.assert_allclose(hard[:, vertex], np.broadcast_to(point, (len(angles), 3)), atol=2e-6)


def test_fist_stays_close_to_the_blended_skin():
    hand = load_hand()
    rigid = build_rigid_hand(hand)
    named = postures(np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper))
    fist = np.rad2deg(named["fist"][0])
    for finger in ("index", "middle", "ring", "pinky"):
        flexion = [fist[HINGES.index(f"{finger}_{name}_flexion")] for name in ("mcp", "pip", "dip")]
        np.testing.assert_allclose(flexion, (60, 70, 40))
    found = 1e3 * errors(hand, [], rigid, named["fist"])
    assert found.mean() < 1.5
    assert np.percentile(found, 95) < 5.0
    # No other division into whole links could do much better: each vertex's best link.
    best = np.min([errors_if_all_follow(hand, rigid, named["fist"], link) for link in range(16)], axis=0)
    assert found.mean() < 1.1 * 1e3 * best.mean()


def errors_if_all_follow(hand, rigid, angles, link) -> np.ndarray:
    rotations = joint_rotations(angles.astype(np.float32), rigid)
    soft, _ = skin(hand, rotations, jnp.zeros((len(angles), 10)))
    one = replace(hand, weights=np.tile(np.eye(16, dtype=np.float32)[link], (hand.num_vertices, 1)))
    hard, _ = skin(one, rotations, jnp.zeros((len(angles), 10)))
    return np.linalg.norm(np.asarray(hard - soft), axis=-1)


def test_real_grasp_stays_close_to_the_blended_skin(recordings):
    hand = load_hand()
    rigid = build_rigid_hand(hand)
    motion = load_motion(recordings / "dexmv_mustard" / "sequence.npz")
    angles = np.asarray(project(np.asarray(motion.rotations, np.float32), rigid))
    found = 1e3 * errors(hand, [], rigid, angles[::4])
    assert found.mean() < 1.5
    assert np.percentile(found, 95) < 5.0


def test_postures_are_within_the_limits_and_flex_each_hinge(rigid):
    lower, upper = np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper)
    named = postures(lower, upper)
    alone = np.concatenate([rows for name, rows in named.items() if name.endswith("flexion")])
    assert (np.count_nonzero(alone, axis=1) == 1).all()
    assert {HINGES[k] for k in np.nonzero(alone)[1]} == {h for h in HINGES if h.endswith("flexion")}
    for rows in named.values():
        assert ((lower <= rows) & (rows <= upper)).all()
