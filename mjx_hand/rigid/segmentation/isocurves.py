"""The skin split into 16 patches along smooth curves, about where one link's pull on it equals the next one's.

Whole triangles would leave a saw-tooth border, which shows as torn flaps when the hand closes. Triangles that a border
crosses are therefore divided: every edge whose ends belong to different links gets one new vertex, and a triangle whose
three corners do gets one in its middle, where three patches meet.
"""

import dataclasses

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import LINKS, NUM_LINKS, PARENTS, TIP_LINKS
from mjx_hand.hand.model import HandModel
from mjx_hand.rigid.segmentation.diffusion import diffused
from mjx_hand.rigid.segmentation.taut_borders import taut

# How far (m) the links' patches are blurred into one another before the borders are drawn: teeth of this size go. More
# of it moves borders away from where rigid links follow the skin best.
BLUR = 0.010
# How far skin may reach behind a phalanx's own joint, in bone lengths: none beyond the second figure. When the finger
# flexes such skin (the thumb's web) would swing out at the back of the hand.
BEHIND = (0.0, 0.05)


@dataclasses.dataclass(frozen=True)
class Patches:
    """A divided skin. New vertices are convex sums of old ones, so that the division serves every shape and pose.

    Attributes:
        corners, shares: each vertex as a weighted sum of three of the undivided mesh's; its own come first.
        faces: triangles of the divided skin.
        face_links: the link of each.
        vertex_links: the link of each of the mesh's own vertices.
    """

    corners: Int[np.ndarray, "n 3"]
    shares: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "f 3"]
    face_links: Int[np.ndarray, "f"]
    vertex_links: Int[np.ndarray, "v"]

    def vertices(self, whole: Float[np.ndarray, "*b v 3"]) -> Float[np.ndarray, "*b n 3"]:
        """The divided skin's vertices for the undivided mesh's."""
        return (whole[..., self.corners, :] * self.shares[..., None]).sum(axis=-2)


def patches(hand: HandModel) -> Patches:
    """The skin of the hand, divided so that each link has one connected patch of it.

    Raises:
        InputError: a link gets no skin, or the mesh is in several parts or has faces without area.
    """
    if (hand.faces == np.roll(hand.faces, 1, axis=1)).any():
        raise InputError(f"{hand.name}: some faces have a corner twice; give one surface of triangles")
    pull = link_pull(hand)
    labels = _connected(hand, pull)
    return _divide(np.asarray(hand.template, dtype=float), np.asarray(hand.faces), pull, labels)


def link_pull(hand: HandModel) -> Float[np.ndarray, "v 16"]:
    """How strongly each link holds each vertex, 0 to 1: the links' patches by skinning weight, blurred.

    A border between blurred patches is a gentle curve however rough the painted weights are: one step of mean curvature
    motion by diffusion (Merriman, Bence and Osher, "Motion of multiple junctions", J. Comput. Phys. 112, 1994).

    Raises:
        InputError: a link gets no skin, or the mesh is in several parts.
    """
    template = np.asarray(hand.template, dtype=float)
    weights = np.array(hand.weights, dtype=float)
    centres = np.asarray(hand.joint_regressor, dtype=float) @ template
    for link, bone in enumerate(bones(template, centres, np.asarray(hand.tip_vertices))[1:], start=1):
        behind = -(template - centres[link]) @ bone / (bone @ bone)
        weights[:, link] *= np.clip((BEHIND[1] - behind) / (BEHIND[1] - BEHIND[0]), 0, 1)
    return diffused(np.eye(NUM_LINKS)[_connected(hand, weights)], template, np.asarray(hand.faces), BLUR)


def _off_the_palm(labels: Int[np.ndarray, "v"], edges: Int[np.ndarray, "e 2"]) -> Int[np.ndarray, "v"]:
    """Labels in which the palm's skin meets that of base phalanges only: what lies between joins the base phalanx.

    Where the thumb's second phalanx reaches the palm, three patches end in a fringe that tears as the thumb bends.
    """
    labels = labels.copy()
    both = np.concatenate([edges, edges[:, ::-1]])
    inner = np.array([link > 0 and PARENTS[link] > 0 for link in range(NUM_LINKS)])
    while True:
        touching = np.unique(both[inner[labels[both[:, 0]]] & (labels[both[:, 1]] == 0), 0])
        if not len(touching):
            return labels
        labels[touching] = np.array(PARENTS)[labels[touching]]


def bones(
    rest: Float[np.ndarray, "v 3"], centres: Float[np.ndarray, "16 3"], tip_vertices: Int[np.ndarray, "5"]
) -> Float[np.ndarray, "16 3"]:
    """From each link's joint to the next joint or the finger's tip (m); zero for the wrist, which has no one bone."""
    ends = np.array(centres)
    ends[[PARENTS[link] for link in range(1, NUM_LINKS)]] = centres[1:]
    ends[list(TIP_LINKS)] = rest[tip_vertices]
    ends[0] = centres[0]
    return ends - centres


def _edges(faces: Int[np.ndarray, "f 3"]) -> Int[np.ndarray, "e 2"]:
    """A mesh's edges, each once, the lower vertex first."""
    return np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)


def _connected(hand: HandModel, pull: Float[np.ndarray, "v 16"]) -> Int[np.ndarray, "v"]:
    """The link of each vertex: the strongest, except at the palm's rim, and that islands join what surrounds them."""
    edges = _edges(np.asarray(hand.faces))
    a, b = edges.T
    labels = pull.argmax(axis=1)
    missing = [LINKS[link] for link in range(NUM_LINKS) if not (labels == link).any()]
    if missing:
        raise InputError(
            f"{hand.name}: no skin follows {', '.join(missing)}; "
            "each link's weight must be the largest on some vertices"
        )
    labels = _off_the_palm(labels, edges)
    if len(np.unique(labels)) < NUM_LINKS:
        raise InputError(f"{hand.name}: its faces join finger tips to the palm; give the surface of one hand")
    while True:
        same = labels[a] == labels[b]
        graph = coo_array((np.ones(same.sum()), (a[same], b[same])), shape=(len(labels), len(labels)))
        count, part = connected_components(graph, directed=False)
        if count == NUM_LINKS:
            return labels
        size = np.bincount(part)
        link_of_part = np.zeros(count, int)
        link_of_part[part] = labels
        largest = {link: max(np.flatnonzero(link_of_part == link), key=lambda p: size[p]) for link in range(NUM_LINKS)}
        island = min(set(range(count)) - set(largest.values()), key=lambda p: size[p])
        inside = part == island
        crossing = inside[a] != inside[b]
        if not crossing.any():
            raise InputError(f"{hand.name}: the mesh falls into separate parts; give one connected surface")
        around = labels[np.where(inside[a], b, a)[crossing]]
        labels[inside] = np.bincount(around).argmax()


def _divide(
    template: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
    pull: Float[np.ndarray, "v 16"],
    labels: Int[np.ndarray, "v"],
) -> Patches:
    count = len(labels)
    corners = [np.tile(np.arange(count)[:, None], 3)]
    shares = [np.tile([1.0, 0.0, 0.0], (count, 1))]

    # A vertex on every edge whose ends have different links: about where the two pull alike, then drawn taut.
    edges = _edges(faces)
    crossed = edges[labels[edges[:, 0]] != labels[edges[:, 1]]]
    a, b = crossed.T
    lead_a = np.maximum(pull[a, labels[a]] - pull[a, labels[b]], 1e-9)
    lead_b = np.maximum(pull[b, labels[b]] - pull[b, labels[a]], 1e-9)
    along = taut(lead_a / (lead_a + lead_b), crossed, template, faces)
    corners.append(np.stack([a, b, b], axis=1))
    shares.append(np.stack([1 - along, along, 0 * along], axis=1))
    on_edge = {pair: count + k for k, pair in enumerate(zip(a.tolist(), b.tolist(), strict=True))}

    mixed = labels[faces]
    kinds = (mixed[:, 0] != mixed[:, 1]).astype(int) + (mixed[:, 1] != mixed[:, 2]) + (mixed[:, 2] != mixed[:, 0])
    whole = kinds == 0
    triangles, links = faces[whole].tolist(), mixed[whole, 0].tolist()
    middles = []
    for face in faces[~whole]:
        found = labels[face]
        if found[0] == found[1] or found[1] == found[2] or found[2] == found[0]:
            apex = next(k for k in range(3) if found[k] not in (found[k - 1], found[k - 2]))
            i, j, k = (int(v) for v in np.roll(face, -apex))
            p, q = on_edge[min(i, j), max(i, j)], on_edge[min(k, i), max(k, i)]
            triangles += [[i, p, q], [p, j, k], [p, k, q]]
            links += [labels[i], labels[j], labels[j]]
            continue
        i, j, k = face.tolist()
        p, q, r = (on_edge[min(x, y), max(x, y)] for x, y in ((i, j), (j, k), (k, i)))
        middle = count + len(a) + len(middles)
        middles.append(face)
        for x, ahead, back in ((i, p, r), (j, q, p), (k, r, q)):
            triangles += [[x, ahead, middle], [x, middle, back]]
            links += [labels[x]] * 2
    if middles:
        corners.append(np.array(middles))
        shares.append(np.full((len(middles), 3), 1 / 3))
    return Patches(
        np.concatenate(corners), np.concatenate(shares), np.array(triangles), np.array(links, dtype=int), labels
    )
