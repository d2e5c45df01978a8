"""Which link each whole triangle of the skin belongs to: what the collision capsules are fitted to.

The capsules want whole triangles of the mean shape's mesh, so that they do not depend on how `isocurves` shapes the
borders of the drawn segments.
"""

from collections import Counter

import numpy as np
import trimesh
from jaxtyping import Bool, Int

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import LINKS, NUM_LINKS, PARENTS, TIP_LINKS
from mjx_hand.hand.model import HandModel

BEHIND = 0.2  # how far a phalanx may reach behind its own joint, in bone lengths


def face_links(hand: HandModel) -> Int[np.ndarray, "f"]:
    """The link that each face belongs to: the argmax of its corners' summed skin weights.

    Two repairs: a face far behind a phalanx's joint goes to its next best link, for when the finger flexes that skin
    (the thumb's web) would swing out at the back of the hand; and stray islands join the neighbour that they share
    most edges with, so that each link is one connected patch.

    Raises:
        InputError: a link gets no face at all.
    """
    faces = np.asarray(hand.faces)
    weight = np.asarray(hand.weights)[faces].sum(axis=1)
    labels = np.where(_behind(hand), 0, weight).argmax(axis=1)
    missing = sorted(set(range(NUM_LINKS)) - set(labels.tolist()))
    if missing:
        names = ", ".join(LINKS[link] for link in missing)
        raise InputError(f"{hand.name}: no faces follow {names}; each link's weight must be the largest on some faces")
    pairs = np.asarray(trimesh.graph.face_adjacency(faces))
    while True:
        islands = _islands(labels, pairs)
        if not islands:
            return labels
        for island in islands:
            inside = np.isin(pairs, island)
            border = pairs[inside[:, 0] != inside[:, 1]]
            if not len(border):
                raise InputError(f"{hand.name}: the mesh falls into separate parts; give one connected surface")
            neighbours = labels[np.where(np.isin(border[:, 0], island), border[:, 1], border[:, 0])]
            labels[island] = Counter(neighbours.tolist()).most_common(1)[0][0]


def _behind(hand: HandModel) -> Bool[np.ndarray, "f 16"]:
    """Whether each face of the mean shape lies more than `BEHIND` bone lengths behind each link's joint."""
    template = np.asarray(hand.template)
    centres = np.asarray(hand.joint_regressor) @ template
    behind = np.zeros((len(hand.faces), NUM_LINKS), bool)
    for link in range(1, NUM_LINKS):
        distal = link in TIP_LINKS
        end = template[hand.tip_vertices[TIP_LINKS.index(link)]] if distal else centres[PARENTS.index(link)]
        bone = end - centres[link]
        along = (template[hand.faces].mean(axis=1) - centres[link]) @ bone / (bone @ bone)
        behind[:, link] = along < -BEHIND
    return behind


def _islands(labels: Int[np.ndarray, "f"], pairs: Int[np.ndarray, "e 2"]) -> list[np.ndarray]:
    """Connected patches of one label, except each label's largest."""
    same = pairs[labels[pairs[:, 0]] == labels[pairs[:, 1]]]
    patches = trimesh.graph.connected_components(same, nodes=np.arange(len(labels)))
    patches = sorted(patches, key=len, reverse=True)
    seen: set[int] = set()
    islands = []
    for patch in patches:
        label = int(labels[patch[0]])
        if label in seen:
            islands.append(np.asarray(patch))
        seen.add(label)
    return islands
