"""Collision capsules: one a phalanx, a row of them for the palm, fitted to the skin.

A capsule is a segment and a radius. The fit minimises the area-weighted squared distance from the skin (its face
centres) to the capsule's surface by damped Gauss-Newton steps.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from mjx_hand.hand.joints import LINKS, NUM_LINKS, PARENTS, TIP_LINKS

Capsules = tuple[Float[np.ndarray, "c 2 3"], Float[np.ndarray, "c"]]

_STEPS = 8
_DAMPING = 0.02  # of the mean squared weight: keeps directions that the skin does not determine where they started


def phalanx_capsules(
    points: list[Float[np.ndarray, "_ 3"]],
    areas: list[Float[np.ndarray, "_"]],
    centres: Float[np.ndarray, "16 3"],
    tips: Float[np.ndarray, "5 3"],
) -> Capsules:
    """Capsules of the 15 phalanges (links 1 to 15), in the hand frame.

    A capsule runs from its own joint to the next, so that consecutive ones share the round of the knuckle between
    them and leave no notch when the finger bends; its line may shift and tilt across the bone. The distal one's far
    end slides along the bone too, so that its cap meets the tip.

    Args:
        points, areas: skin samples (m) and their areas (m^2), a list entry for each of the 16 links.
        centres: rest joint centres (m).
        tips: finger tips (m).
    """
    ends, radii = [], []
    for link in range(1, NUM_LINKS):
        distal = link in TIP_LINKS
        far = tips[TIP_LINKS.index(link)] if distal else centres[PARENTS.index(link)]
        segment = np.stack([centres[link], far])
        bone = _unit(segment[1] - segment[0])
        # Fit the shaft alone: a link's skin reaches behind its joint, into the web, where it is no tube.
        along = (points[link] - segment[0]) @ bone
        shaft = (along > 0) & (distal | (along < np.linalg.norm(segment[1] - segment[0])))
        skin, area = points[link][shaft], areas[link][shaft]
        radius = float(np.median(np.linalg.norm(np.cross(skin - segment[0], bone), axis=1)))
        if distal:
            segment[1] -= radius * bone
        segment, radius = _fit(skin, area, segment, radius, slides=np.array([False, distal]))
        ends.append(segment)
        radii.append(radius)
    return np.stack(ends), np.array(radii)


def palm_capsules(
    points: Float[np.ndarray, "p 3"], areas: Float[np.ndarray, "p"], centres: Float[np.ndarray, "16 3"]
) -> Capsules:
    """Capsules of the palm, in the hand frame: four metacarpals and the carpus, across the wrist.

    Each is fitted to the skin that is nearest to it. The ball of the thumb is the thumb's own first link, and the fold
    of skin between thumb and index has none: it gives way in a real hand.
    """
    joint = dict(zip(LINKS, centres, strict=True))
    wrist = joint["wrist"]
    knuckles = [joint[f"{finger}1"] for finger in ("index", "middle", "ring", "pinky")]
    # Metacarpals fan out from the carpus, whose width is about two thirds of the knuckles'.
    middle = np.mean(knuckles, axis=0)
    hand = middle - wrist
    bases = [wrist + 0.25 * hand + 0.6 * (knuckle - middle) for knuckle in knuckles]
    carpus = (0.5 * (wrist + bases[0]), 0.5 * (wrist + bases[3]))
    ends = np.array([*zip(bases, knuckles, strict=True), carpus])
    radii = np.full(len(ends), 0.15 * np.linalg.norm(hand))
    # The mesh runs on into the forearm, and the thumb's web stands off the palm: neither is fitted.
    along = (points - wrist) @ hand / (hand @ hand)
    kept = (along > -0.1) & (surface_distance(points, ends, radii) < radii[0])
    points, areas = points[kept], areas[kept]
    slides = np.array([True, False])
    for _ in range(3):
        nearest = (segment_distance(points, ends) - radii).argmin(axis=1)
        for k in range(len(ends)):
            mine = nearest == k
            if mine.sum() >= 12:
                ends[k], radii[k] = _fit(points[mine], areas[mine], ends[k], radii[k], slides)
    return ends, radii


def segment_distance(points: Float[np.ndarray, "p 3"], ends: Float[np.ndarray, "c 2 3"]) -> Float[np.ndarray, "p c"]:
    """Distance (m) from each point to each segment."""
    _, foot = _foot(points[:, None], ends)
    return np.linalg.norm(points[:, None] - foot, axis=-1)


def surface_distance(
    points: Float[np.ndarray, "p 3"], ends: Float[np.ndarray, "c 2 3"], radii: Float[np.ndarray, "c"]
) -> Float[np.ndarray, "p"]:
    """Signed distance (m) from each point to the union of capsules, negative inside."""
    return (segment_distance(points, ends) - radii).min(axis=1)


def _foot(points: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The segments' nearest parameter (0 to 1) and point, broadcast over points."""
    along = ends[..., 1, :] - ends[..., 0, :]
    t = np.clip(((points - ends[..., 0, :]) * along).sum(-1) / (along * along).sum(-1), 0, 1)
    return t, ends[..., 0, :] + t[..., None] * along


def _fit(
    points: Float[np.ndarray, "p 3"],
    areas: Float[np.ndarray, "p"],
    ends: Float[np.ndarray, "2 3"],
    radius: float,
    slides: Bool[np.ndarray, "2"],
) -> tuple[Float[np.ndarray, "2 3"], float]:
    """A capsule fitted to points; an end moves across the bone, and along it only where it `slides`."""
    bone = _unit(ends[1] - ends[0])
    weight = areas / areas.sum()
    projections = [np.eye(3) if slide else np.eye(3) - np.outer(bone, bone) for slide in slides]
    ends = ends.copy()
    for _ in range(_STEPS):
        t, foot = _foot(points, ends)
        off = points - foot
        distance = np.linalg.norm(off, axis=1)
        normal = off / np.maximum(distance, 1e-9)[:, None]
        # d(distance - radius) by the two ends and the radius.
        near, far = (1 - t)[:, None] * (normal @ projections[0]), t[:, None] * (normal @ projections[1])
        rows = -np.concatenate([near, far, np.ones((len(t), 1))], axis=1)
        normal_matrix = rows.T @ (weight[:, None] * rows) + _DAMPING * np.diag([1.0] * 6 + [0.0])
        step = np.linalg.solve(normal_matrix, -rows.T @ (weight * (distance - radius)))
        ends[0] += projections[0] @ step[:3]
        ends[1] += projections[1] @ step[3:6]
        radius += float(step[6])
    return ends, radius


def _unit(v: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    return v / np.linalg.norm(v)


def skin_samples(
    vertices: Float[np.ndarray, "m 3"], faces: Int[np.ndarray, "f 3"]
) -> tuple[Float[np.ndarray, "f 3"], Float[np.ndarray, "f"]]:
    """Centres (m) and areas (m^2) of triangles."""
    corners = vertices[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    return corners.mean(axis=1), areas
