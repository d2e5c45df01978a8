import numpy as np

from mjx_hand.rigid.segmentation.taut_borders import MARGIN, taut


def strip(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Two rows of vertices, 10 mm apart, with a zigzag of triangles between them."""
    x = np.arange(count) * 4e-3
    vertices = np.concatenate([np.stack([x, 0 * x, 0 * x], 1), np.stack([x + 2e-3, 0 * x + 0.01, 0 * x], 1)])
    low = np.arange(count - 1)
    faces = np.concatenate(
        [np.stack([low, low + 1, low + count], 1), np.stack([low + 1, low + count + 1, low + count], 1)]
    )
    return vertices, faces


def test_a_toothed_border_becomes_straight():
    vertices, faces = strip(12)
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    crossed = edges[(edges[:, 0] < 12) & (edges[:, 1] >= 12)]
    along = np.where(np.arange(len(crossed)) % 2, 0.9, 0.1)
    found = taut(along, crossed, vertices, faces)
    assert np.ptp(found) < 0.2  # against 0.8
    assert np.ptp(found[5:-5]) < 0.02  # the ends hang free
    assert ((found >= MARGIN) & (found <= 1 - MARGIN)).all()


def test_where_three_patches_meet_the_middle_holds():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    crossed = np.array([[0, 1], [0, 2], [1, 2]])
    found = taut(np.array([0.9, 0.1, 0.3]), crossed, vertices, np.array([[0, 1, 2]]))
    # The foot of the triangle's middle on each edge.
    np.testing.assert_allclose(found, [1 / 3, 1 / 3, 1 / 2], atol=1e-6)
