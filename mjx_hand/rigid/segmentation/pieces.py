"""Parts of a surface, closed by flat caps."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from mjx_hand.rigid.segmentation.borders import border_loops, cap_outlines, directed_edges


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


def face_left_of(faces: Int[np.ndarray, "f 3"], links: Int[np.ndarray, "f"]) -> dict[tuple[int, int], int]:
    """The link of the face on the left of each directed edge of a whole mesh."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()
    return dict(zip(map(tuple, edges), np.repeat(links, 3).tolist(), strict=True))


def across(border: Int[np.ndarray, "_"], links: dict[tuple[int, int], int]) -> list[int]:
    """The link on the other side of each edge of a border, from each vertex to the next; -1 where there is none."""
    return [links.get(pair, -1) for pair in zip(np.roll(border, -1).tolist(), border.tolist(), strict=True)]


def close(
    faces: Int[np.ndarray, "f 3"],
    links: dict[tuple[int, int], int] | None = None,
    leave_open: Sequence[Int[np.ndarray, "_"]] = (),
) -> Piece:
    """The piece of surface that these faces make, with caps over its border.

    Args:
        faces: triangles over the whole mesh's vertices.
        links: the whole mesh's `face_left_of`; a border then has a cap for each link on its other side.
        leave_open: loops of the border (as `border_loops` gives them) that get no cap.
    """
    ids, flat = np.unique(faces, return_inverse=True)
    own = flat.reshape(-1, 3)
    skin_edges = directed_edges(own)
    open_loops = {loop.tobytes() for loop in leave_open}
    outlines: list[np.ndarray] = []
    for loop in border_loops(faces):
        if loop.tobytes() not in open_loops:
            on_own = np.searchsorted(ids, loop).tolist()
            outlines += cap_outlines(on_own, across(loop, links or {}), skin_edges)
    fans = []
    for k, outline in enumerate(outlines):
        centre = np.full(len(outline), len(ids) + k)
        # The border runs with the skin, so the cap, on the other side of each edge, runs against it.
        fans.append(np.stack([np.roll(outline, -1), outline, centre], axis=1))
    return Piece(ids, np.concatenate([own, *fans]), tuple(outlines), len(own))
