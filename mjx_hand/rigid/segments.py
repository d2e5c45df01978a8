"""A skinned hand cut into 16 closed rigid segments, with their masses and inertias (paper, section III-A)."""

import dataclasses
from collections import Counter

import numpy as np
import trimesh
from jaxtyping import Bool, Float, Int

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import LINKS, NUM_LINKS, PARENTS, TIP_LINKS
from mjx_hand.hand.model import HandModel

DENSITY = 1100.0  # kg/m^3: a little above muscle's, for the bone in it
BEHIND = 0.2  # how far a phalanx may reach behind its own joint, in bone lengths


@dataclasses.dataclass(frozen=True)
class Piece:
    """Part of a surface, closed: the part's own faces and caps, each a fan from its outline to the outline's centroid.

    Attributes:
        vertex_ids: the part's vertices in the whole mesh.
        faces: triangles over the part's own vertices, then one centroid a cap.
        outlines: each cap's outline, as indices into `vertex_ids`.
        num_skin_faces: how many of `faces`, the first ones, are skin; the rest are caps.
    """

    vertex_ids: Int[np.ndarray, "n"]
    faces: Int[np.ndarray, "f 3"]
    outlines: tuple[Int[np.ndarray, "_"], ...]
    num_skin_faces: int

    def vertices(self, whole: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "m 3"]:
        """The piece's vertices (m) for the whole mesh's: its own, then the caps' centres."""
        own = whole[self.vertex_ids]
        return np.concatenate([own, *(own[outline].mean(axis=0, keepdims=True) for outline in self.outlines)])


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


def border_loops(faces: Int[np.ndarray, "f 3"]) -> list[Int[np.ndarray, "_"]]:
    """Simple closed loops of the edges that only one face has, in the faces' direction.

    A vertex that the border passes twice splits it into separate loops: closing each then leaves every edge two faces.
    """
    directed = _directed_edges(faces)
    following: dict[int, list[int]] = {}
    for a, b in sorted(directed):
        if (b, a) not in directed:
            following.setdefault(a, []).append(b)
    loops = []
    while following:
        path = [next(iter(following))]
        while path:
            ahead = following.get(path[-1])
            if not ahead:
                break
            step = ahead.pop()
            if not ahead:
                del following[path[-1]]
            if step in path:
                start = path.index(step)
                loops.append(np.array(path[start:]))
                path = path[: start + 1]  # a vertex passed twice may go on from here
            else:
                path.append(step)
    return loops


def cap_outlines(loop: list[int], beyond: list[int], skin_edges: set[tuple[int, int]]) -> list[Int[np.ndarray, "_"]]:
    """Split a border loop into the outlines of flat-ish caps, one for each segment on the other side.

    At a finger's base three segments meet twice, on the back and on the palm of the hand. A straight chord from one
    meeting point to the other gives each pair of segments an outline of its own, which both find: their caps coincide,
    and the segments fill the hand without gap or overlap.

    Args:
        loop: border vertices in order.
        beyond: the segment across the edge from each vertex to the next.
        skin_edges: edges that the segment's skin has, which a chord must not double.
    """
    outlines = []
    vertices, labels = list(loop), list(beyond)
    while len(set(labels)) > 1:
        while labels[0] == labels[-1]:  # begin at a change of segment
            vertices.append(vertices.pop(0))
            labels.append(labels.pop(0))
        starts = [k for k in range(len(labels)) if labels[k] != labels[k - 1]]
        runs = list(zip(starts, [*starts[1:], len(labels)], strict=True))
        times = Counter(labels[start] for start, _ in runs)
        # A segment met once lies outermost; cutting it off brings the two stretches of the one before it together.
        start, end = min(runs, key=lambda run: (times[labels[run[0]]], run[1] - run[0]))
        before, a, b = labels[start - 1], vertices[start], vertices[end % len(vertices)]
        if end - start == 1 or (a, b) in skin_edges or (b, a) in skin_edges:
            labels[start:end] = [before] * (end - start)
            continue
        outlines.append(np.array([*vertices[start:end], b]))
        del vertices[start + 1 : end]
        labels[start:end] = [before]
    if len(vertices) > 2:
        outlines.append(np.array(vertices))
    return outlines


def close(faces: Int[np.ndarray, "f 3"], neighbours: dict[tuple[int, int], int] | None = None) -> Piece:
    """The piece of surface that these faces make, with caps over its border.

    Args:
        faces: triangles over the whole mesh's vertices.
        neighbours: the segment of the face on the left of each directed edge, for every face of the whole mesh.
    """
    ids, flat = np.unique(faces, return_inverse=True)
    own = flat.reshape(-1, 3)
    skin_edges = _directed_edges(own)
    outlines: list[np.ndarray] = []
    for loop in border_loops(own):
        pairs = zip(ids[np.roll(loop, -1)].tolist(), ids[loop].tolist(), strict=True)
        beyond = [(neighbours or {}).get(pair, -1) for pair in pairs]
        outlines += cap_outlines(loop.tolist(), beyond, skin_edges)
    fans = []
    for k, outline in enumerate(outlines):
        centre = np.full(len(outline), len(ids) + k)
        # The border runs with the skin, so the cap, on the other side of each edge, runs against it.
        fans.append(np.stack([np.roll(outline, -1), outline, centre], axis=1))
    return Piece(ids, np.concatenate([own, *fans]), tuple(outlines), len(own))


def cut(hand: HandModel) -> list[Piece]:
    """The 16 closed segments, in the order of `LINKS`; the same for every shape."""
    faces, labels = np.asarray(hand.faces), face_links(hand)
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()
    neighbours = dict(zip(map(tuple, edges), np.repeat(labels, 3).tolist(), strict=True))
    return [close(faces[labels == link], neighbours) for link in range(NUM_LINKS)]


def _directed_edges(faces: Int[np.ndarray, "f 3"]) -> set[tuple[int, int]]:
    return set(map(tuple, faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))


def mass_properties(
    vertices: Float[np.ndarray, "m 3"], faces: Int[np.ndarray, "f 3"]
) -> tuple[float, Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
    """Mass (kg) at `DENSITY`, centre of mass (m) and inertia about it (kg m^2) of a closed surface."""
    found = trimesh.triangles.mass_properties(vertices[faces], density=DENSITY)
    return float(found.mass), np.asarray(found.center_mass), np.asarray(found.inertia)
