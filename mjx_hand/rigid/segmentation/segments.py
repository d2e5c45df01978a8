"""A skinned hand cut into 16 closed rigid segments, with their masses and inertias (paper, section III-A).

Each segment is closed twice. Its *solid* has flat caps that coincide with its neighbours', so that the 16 solids fill
the hand without gap or overlap: masses come from it. Its *surface*, which is drawn, has a dome at each joint that
reaches into the neighbour and so overlaps it: no gap opens when the joint bends, and no hollow shows behind a web.
"""

import dataclasses
import functools
from collections import Counter

import numpy as np
import trimesh
from jaxtyping import Float, Int

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import LINKS, NUM_LINKS, PARENTS
from mjx_hand.hand.model import HandModel
from mjx_hand.rigid.segmentation.borders import border_loops, cap_outlines, directed_edges
from mjx_hand.rigid.segmentation.domes import Dome, dome
from mjx_hand.rigid.segmentation.isocurves import Patches, bones, patches
from mjx_hand.rigid.segmentation.pieces import Piece, across, close, face_left_of

DENSITY = 1100.0  # kg/m^3: a little above muscle's, for the bone in it


@dataclasses.dataclass(frozen=True)
class Segment:
    """One link of the hand.

    Attributes:
        solid: what the link weighs, over the divided skin's vertices.
        shell: skin, and flat caps over the mesh's own holes, over the divided skin's vertices.
        domes: caps towards other links; each with the vertices of `shell` that its border runs through, and the link
            whose joint it turns about.
    """

    solid: Piece
    shell: Piece
    domes: tuple[tuple[Int[np.ndarray, "_"], int, Dome], ...]

    def surface(
        self, divided: Float[np.ndarray, "n 3"], centres: Float[np.ndarray, "16 3"]
    ) -> tuple[Float[np.ndarray, "m 3"], Int[np.ndarray, "f 3"]]:
        """Vertices (m) and triangles of the closed surface to draw, the skin's first.

        Args:
            divided: the divided skin's vertices (m), of any shape; the whole mesh's own come first.
            centres: the links' joints (m).
        """
        vertices, faces = [self.shell.vertices(divided)], [self.shell.faces]
        count = len(vertices[0])
        for border, joint, cap in self.domes:
            on_skin = np.einsum("mk,mkc->mc", cap.shares, divided[cap.corners])
            vertices.append(on_skin + cap.inward[:, None] * (centres[joint] - on_skin))
            faces.append(np.concatenate([border, count + np.arange(len(on_skin))])[cap.faces])
            count += len(on_skin)
        return np.concatenate(vertices), np.concatenate(faces)


@dataclasses.dataclass(frozen=True)
class Cut:
    """A hand's division into segments, the same for every shape.

    Attributes:
        skin: the divided skin.
        segments: one a link, in the order of `LINKS`.
    """

    skin: Patches
    segments: tuple[Segment, ...]


@functools.lru_cache(maxsize=4)  # by the hand's identity: whoever builds many shapes of one hand cuts it once
def cut(hand: HandModel) -> Cut:
    """Cut the skin of a hand into 16 segments.

    Raises:
        InputError: a link gets no skin, the mesh is in several parts or not consistently turned, or a joint lies
            outside the skin.
    """
    skin = patches(hand)
    template = np.asarray(hand.template, dtype=float)
    divided = skin.vertices(template)
    centres = np.asarray(hand.joint_regressor, dtype=float) @ template
    closed = _closed(np.asarray(hand.faces))
    outward = bones(template, centres, np.asarray(hand.tip_vertices))
    links = face_left_of(skin.faces, skin.face_links)
    if len(links) != skin.faces.size:  # an edge that two faces run along the same way
        raise InputError(f"{hand.name}: its faces do not all look outward; give one surface, turned one way")
    segments = []
    for link in range(NUM_LINKS):
        faces = skin.faces[skin.face_links == link]
        borders = [border for border in border_loops(faces) if max(across(border, links)) >= 0]  # no holes of the mesh
        shell = close(faces, links, leave_open=borders)
        domes = []
        for outline, joint in _sockets(link, faces, borders, links):
            pole = outward[joint] / np.linalg.norm(outward[joint]) * (-1 if joint == link else 1)
            cap = dome(divided[outline], centres[joint], pole, template, closed)
            if (cap.inward >= 1).any():
                raise InputError(f"{hand.name}: the joint of {LINKS[joint]} lies outside the skin; fix the regressor")
            domes.append((np.searchsorted(shell.vertex_ids, outline), joint, cap))
        segments.append(Segment(close(faces, links), shell, tuple(domes)))
    return Cut(skin, tuple(segments))


def _sockets(
    link: int, faces: Int[np.ndarray, "f 3"], borders: list[Int[np.ndarray, "_"]], links: dict[tuple[int, int], int]
) -> list[tuple[Int[np.ndarray, "_"], int]]:
    """The outlines that need a dome each, and the link whose joint it turns about.

    Towards its parent a segment has one dome about its own joint, whatever else it touches there (the next finger).
    Towards the links that it carries it has one each: the palm's border runs around several fingers.
    """
    found: list[tuple[np.ndarray, int]] = []
    for border in borders:
        beyond = across(border, links)
        if link and PARENTS[_most(beyond)] != link:
            found.append((border, link))
            continue
        for outline in cap_outlines(border.tolist(), beyond, directed_edges(faces)):
            nearest = _most(across(outline, links))
            found.append((outline, nearest if PARENTS[nearest] == link else link))
    return found


def _most(beyond: list[int]) -> int:
    """The link across most of a border's edges; edges that no face lies across (-1) do not count."""
    return Counter(link for link in beyond if link >= 0).most_common(1)[0][0]


def _closed(faces: Int[np.ndarray, "f 3"]) -> Int[np.ndarray, "g 3"]:
    """The faces, and fans over the mesh's own holes (MANO's wrist), which add no vertices."""
    fans = [np.stack([loop[2:], loop[1:-1], np.full(len(loop) - 2, loop[0])], axis=1) for loop in border_loops(faces)]
    return np.concatenate([faces, *fans])


def mass_properties(
    vertices: Float[np.ndarray, "m 3"], faces: Int[np.ndarray, "f 3"]
) -> tuple[float, Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
    """Mass (kg) at `DENSITY`, centre of mass (m) and inertia about it (kg m^2) of a closed surface."""
    found = trimesh.triangles.mass_properties(vertices[faces], density=DENSITY)
    return float(found.mass), np.asarray(found.center_mass), np.asarray(found.inertia)
