"""Skinning weights of the cut hand: the body's own, mended where they do not fit a hand of 16 links.

The body's weights leave the thumb's metacarpal a strip of 15 vertices, so the ball of the thumb would stay with the
palm; and they let the index finger begin where its knuckle was before `skeleton` moved it. Those two links claim
the palm's skin that is nearer to their bone than to any other, and all weights are then smoothed a little.
"""

import numpy as np
from scipy.sparse import csr_array

from mjx_hand.hand.joints import LINKS

CLAIMANTS = (("index1", "index2"), ("thumb1", "thumb2"))
RIVALS = (
    *(("wrist", f"{finger}1") for finger in ("index", "middle", "ring", "pinky", "thumb")),
    *((f"{finger}1", f"{finger}2") for finger in ("index", "middle", "ring", "pinky", "thumb")),
)
# Skin at this ratio of its distances to the claimant's bone and to the nearest other bone, or less, is claimed
# wholly; at the second ratio it is left alone.
CLAIM_FULL, CLAIM_NONE = 1.0, 1.5
CLAIM_SMOOTHING, SMOOTHING = 4, 1  # passes of averaging with the neighbours
LEAST_WEIGHT = 0.005


def mend_weights(weights: np.ndarray, vertices: np.ndarray, joints: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Weights (v, 16), rows summing to 1, from the body's own.

    Args:
        weights: (v, 16), rows sum to 1.
        vertices: (v, 3).
        joints: (16, 3) or more.
        quads: (q, 4) skin faces, for smoothing.
    """
    average = _neighbour_average(quads, len(vertices))
    weights = weights.copy()
    for claimant in CLAIMANTS:
        share = _claim(claimant, vertices, joints)
        for _ in range(CLAIM_SMOOTHING):
            share = average @ share
        weights[:, LINKS.index(claimant[0])] += share * weights[:, 0]
        weights[:, 0] *= 1 - share
    for _ in range(SMOOTHING):
        weights = np.asarray(average @ weights)
    weights[weights < LEAST_WEIGHT] = 0
    return weights / weights.sum(axis=1, keepdims=True)


def _claim(claimant: tuple[str, str], vertices: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """Share (v,) of the palm's weight that a link takes over, 0 to 1."""

    def distance(bone: tuple[str, str]) -> np.ndarray:
        a, b = (joints[LINKS.index(name)] for name in bone)
        along = np.clip((vertices - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        return np.linalg.norm(vertices - a - along[:, None] * (b - a), axis=1)

    others = np.min([distance(bone) for bone in RIVALS if bone != claimant], axis=0)
    share = np.clip((CLAIM_NONE - distance(claimant) / others) / (CLAIM_NONE - CLAIM_FULL), 0, 1)
    return share * share * (3 - 2 * share)


def _neighbour_average(quads: np.ndarray, count: int) -> csr_array:
    """The matrix that averages a vertex, by half, with its neighbours along edges."""
    a, b = quads.ravel(), np.roll(quads, -1, axis=1).ravel()
    edges = csr_array((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), shape=(count, count))
    edges.sum_duplicates()
    edges.data[:] = 1
    scale = 0.5 / np.bincount(edges.tocoo().row, minlength=count)
    own = csr_array((np.full(count, 0.5), (np.arange(count), np.arange(count))), shape=(count, count))
    return csr_array(own + edges.multiply(scale[:, None]))
