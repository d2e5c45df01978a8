"""A skinned hand cut into 16 closed rigid segments, with their masses and inertias (paper, section III-A)."""

import dataclasses
from collections import Counter

import numpy as np
import trimesh
from jaxtyping import Float, Int

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import LINKS, NUM_LINKS
from mjx_hand.hand.model import HandModel

DENSITY = (
    1100.0  # kg/m^3: between muscle (1060) and bone (1200-1900); Clauser et al. 1969 measured 1.11 g/ml for the hand
)


@dataclasses.dataclass(frozen=True)
class Piece:
    """Part of a surface, closed: the part's own faces and a fan from each border loop to the loop's centroid.

    Attributes:
        vertex_ids: the part's vertices in the whole mesh.
        faces: triangles over the part's own vertices, then one centroid a loop.
        loops: each border loop, as indices into `vertex_ids`.
        num_skin_faces: how many of `faces`, the first ones, are skin; the rest are caps.
    """

    vertex_ids: Int[np.ndarray, "n"]
    faces: Int[np.ndarray, "f 3"]
    loops: tuple[Int[np.ndarray, "_"], ...]
    num_skin_faces: int

    def vertices(self, whole: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "m 3"]:
        """The piece's vertices (m) for the whole mesh's: its own, then the caps' centres."""
        own = whole[self.vertex_ids]
        return np.concatenate([own, *(own[loop].mean(axis=0, keepdims=True) for loop in self.loops)])


def face_links(hand: HandModel) -> Int[np.ndarray, "f"]:
    """The link that each face belongs to: the argmax of its corners' summed skin weights.

    Each link gets one connected patch: stray islands join the neighbour that they share most edges with.

    Raises:
        InputError: a link gets no face at all.
    """
    faces = np.asarray(hand.faces)
    labels = np.asarray(hand.weights)[faces].sum(axis=1).argmax(axis=1)
    missing = sorted(set(range(NUM_LINKS)) - set(labels.tolist()))
    if missing:
        names = ", ".join(LINKS[link] for link in missing)
        raise InputError(
            f"{hand.name}: no faces follow {names}; every link needs skin weights that dominate some faces"
        )
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
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    directed = set(map(tuple, edges.tolist()))
    following: dict[int, list[int]] = {}
    for a, b in edges.tolist():
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


def close(faces: Int[np.ndarray, "f 3"]) -> Piece:
    """The piece of surface that these faces make, with a cap over each border loop."""
    ids, flat = np.unique(faces, return_inverse=True)
    own = flat.reshape(-1, 3)
    loops = border_loops(own)
    fans = []
    for k, loop in enumerate(loops):
        centre = np.full(len(loop), len(ids) + k)
        # The border runs with the skin, so the cap, on the other side of each edge, runs against it.
        fans.append(np.stack([np.roll(loop, -1), loop, centre], axis=1))
    return Piece(ids, np.concatenate([own, *fans]), tuple(loops), len(own))


def cut(hand: HandModel) -> list[Piece]:
    """The 16 closed segments, in the order of `LINKS`; the same for every shape."""
    labels = face_links(hand)
    return [close(np.asarray(hand.faces)[labels == link]) for link in range(NUM_LINKS)]


def mass_properties(
    vertices: Float[np.ndarray, "m 3"], faces: Int[np.ndarray, "f 3"]
) -> tuple[float, Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
    """Mass (kg) at `DENSITY`, centre of mass (m) and inertia about it (kg m^2) of a closed surface."""
    found = trimesh.triangles.mass_properties(vertices[faces], density=DENSITY)
    return float(found.mass), np.asarray(found.center_mass), np.asarray(found.inertia)
