import numpy as np
import pytest
import trimesh

from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.pytree import replace
from mjx_hand.rigid.segmentation.face_links import face_links


@pytest.fixture(scope="module")
def open_hand():
    return load_hand()


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
