"""Caps like the head of a ball joint: round about the joint's centre, and hidden inside the neighbour at rest.

When the joint bends, a flat cap would leave a gap on the outside of the bend. A dome of the border's own distance from
the joint turns there as a knuckle does.
"""

import dataclasses

import numpy as np
import trimesh
from jaxtyping import Float, Int

from mjx_hand.smoothstep import smoothstep

RINGS = 6  # between the border and the pole
# How far below the neighbour's skin a dome stays, once it is away from its border, as a share of the way to the joint.
DEPTH = 0.06
WIDEST = 1.05  # of the ball's radius: how wide the dome may stay behind its border
# Up to the first angle from its border the dome keeps the border's own distance, from the second on it is the ball: a
# web that is pulled away from the palm then shows this tongue, not a gap.
TONGUE = np.deg2rad([10, 35])
_FOLDED = np.deg2rad(170)  # an arc of 180 degrees has no direction


@dataclasses.dataclass(frozen=True)
class Dome:
    """Vertices between the skin and the joint, so that they follow the hand's shape: each is a point of the skin, drawn
    towards the joint's centre.

    Attributes:
        corners, shares: the point of the skin as a weighted sum of three of its vertices.
        inward: how far towards the centre, 0 to 1.
        faces: triangles; 0 to n-1 are the border's vertices, the dome's own follow.
    """

    corners: Int[np.ndarray, "m 3"]
    shares: Float[np.ndarray, "m 3"]
    inward: Float[np.ndarray, "m"]
    faces: Int[np.ndarray, "f 3"]


def dome(
    border: Float[np.ndarray, "n 3"],
    centre: Float[np.ndarray, "3"],
    pole: Float[np.ndarray, "3"],
    skin: Float[np.ndarray, "v 3"],
    skin_faces: Int[np.ndarray, "f 3"],
) -> Dome:
    """The dome over a border.

    Args:
        border: the patch's border (m), in the direction of its faces.
        centre: the joint (m), inside the skin.
        pole: unit vector from the joint into the neighbour.
        skin, skin_faces: the closed surface (m) that the dome must stay inside.
    """
    count = len(border)
    reach = np.linalg.norm(border - centre, axis=1)
    start = (border - centre) / reach[:, None]
    # Along great circles from the border to the pole.
    angle = np.minimum(np.arccos(np.clip(start @ pole, -1, 1)), _FOLDED)
    along = np.arange(1, RINGS + 1) / (RINGS + 1)
    side = start - (start @ pole)[:, None] * pole
    side /= np.maximum(np.linalg.norm(side, axis=1), 1e-12)[:, None]
    left = angle * (1 - along[:, None])  # (RINGS, n)
    ways = np.cos(left)[..., None] * pole + np.sin(left)[..., None] * side
    ways = np.concatenate([ways.reshape(-1, 3), pole[None]])
    corners, shares, distance = exits(centre, ways, skin, skin_faces)

    # The ball itself: it touches the nearest skin, so that it stays inside however the joint turns.
    nearest = trimesh.triangles.closest_point(skin[skin_faces], np.broadcast_to(centre, (len(skin_faces), 3)))
    ball = (1 - DEPTH) * np.linalg.norm(nearest - centre, axis=1).min()
    sunk = 1 - DEPTH * np.minimum(1, 3 * along)[:, None]
    held = np.clip(reach * (1 - DEPTH), ball, WIDEST * ball)
    neck = smoothstep((angle * along[:, None] - TONGUE[0]) / (TONGUE[1] - TONGUE[0]))
    crown = smoothstep((along - 0.6) / 0.4)[:, None]
    radius = (1 - neck) * reach * sunk + neck * held
    radius = np.append(((1 - crown) * radius + crown * ball).ravel(), ball)
    radius = np.minimum(radius, np.append(np.repeat(sunk, count), 1 - DEPTH) * distance)
    return Dome(corners, shares, 1 - radius / distance, _rings(count))


def exits(
    centre: Float[np.ndarray, "3"],
    ways: Float[np.ndarray, "r 3"],
    skin: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
) -> tuple[Int[np.ndarray, "r 3"], Float[np.ndarray, "r 3"], Float[np.ndarray, "r"]]:
    """Where rays from a point inside a closed surface leave it: the triangle's corners, their shares, the distance (m).

    The distance is infinite where there is no such triangle, which means that the point lies outside.

    Each ray's own triangle is the one whose solid angle contains it (all three of the signed volumes that the ray makes
    with its edges have one sign), the nearest if there are several.
    """
    a, b, c = np.moveaxis(skin[faces] - centre, 1, 0)
    normals = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])  # of the planes through the centre
    volume = (a * normals[0]).sum(axis=-1)
    seen_from_inside = volume > 0
    faces, normals, volume = faces[seen_from_inside], normals[:, seen_from_inside], volume[seen_from_inside]
    # Nearly all pairs of a ray and a triangle miss: single precision finds those that may not, fast.
    rough = np.einsum("ri,sfi->srf", ways.astype(np.float32), normals.astype(np.float32))
    least = np.minimum(np.minimum(rough[0], rough[1]), rough[2])
    rows, columns = np.nonzero(least >= -1e-5 * np.abs(normals).max())
    sides = np.einsum("ki,nki->kn", ways[rows], normals[:, columns])
    total = sides.sum(axis=1)
    # A ray along an edge must not slip between its two triangles.
    hit = (sides.min(axis=1) >= -1e-9 * total) & (total > 1e-12)
    rows, columns, sides, total = rows[hit], columns[hit], sides[hit], total[hit]
    away = volume[columns] / total
    nearest_first = np.lexsort((away, rows))
    found, first = np.unique(rows[nearest_first], return_index=True)
    best = nearest_first[first]
    distance = np.full(len(ways), np.inf)
    corners, shares = np.zeros((len(ways), 3), faces.dtype), np.zeros((len(ways), 3))
    distance[found], corners[found] = away[best], faces[columns[best]]
    shares[found] = sides[best] / total[best, None]
    return corners, shares, distance


def _rings(count: int) -> Int[np.ndarray, "f 3"]:
    """Triangles from the border over the rings to the pole, which is last; they run against the border's direction."""
    ring = np.arange(count)
    ahead = np.roll(ring, -1)
    below = [
        np.concatenate(
            [
                np.stack([ahead, ring, ring + count], axis=1),
                np.stack([ahead, ring + count, ahead + count], axis=1),
            ]
        )
        + k * count
        for k in range(RINGS)
    ]
    last = np.stack([ahead, ring, np.full(count, count)], axis=1) + np.array([RINGS * count, RINGS * count, 0])
    last[:, 2] = (RINGS + 1) * count
    return np.concatenate([*below, last])
