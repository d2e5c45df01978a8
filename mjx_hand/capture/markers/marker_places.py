"""Where a marker sits, said anatomically, so that one description fits every hand; and its YAML form."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.markers.label_patterns import check_pattern
from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import parse_yaml, shown
from mjx_hand.hand.joints import FINGERS, LINKS, TIP_LINKS
from mjx_hand.hand.model import HandModel

TIPS = tuple(f"{finger}_tip" for finger in FINGERS)
# Directions in the right hand's frame; a left hand is its mirror image in x.
DIRECTIONS = {
    "dorsal": (0.0, 1.0, 0.0),
    "palmar": (0.0, -1.0, 0.0),
    "radial": (0.0, 0.0, 1.0),
    "ulnar": (0.0, 0.0, -1.0),
    "distal": (-1.0, 0.0, 0.0),
    "proximal": (1.0, 0.0, 0.0),
}
KEYS = ("joint", "to", "along", "facing", "offset", "vertex", "within", "labels")
WITHIN = 0.0015  # m; how exactly a person sticks a marker on where the set says, unless the set says otherwise


@dataclass(frozen=True)
class MarkerPlace:
    """A place on the skin: from a point on the bone, straight out in an anatomical direction; or a vertex.

    Attributes:
        name: the marker's label.
        joint: the joint (of `hand.joints.LINKS`) at which the bone starts.
        to: the joint or finger tip (`TIPS`) at which it ends.
        along: how far from the one to the other, 0 to 1.
        facing: one or more of `DIRECTIONS`, summed: the way out to the skin.
        offset: distance (m) of the marker's centre from the skin.
        vertex: the hand's vertex, of one hand model only; it takes the place of the four before it.
        within: standard deviation (m) of each component of where the marker really is, about this place.
        labels: regular expressions of other labels that recordings give it.
    """

    name: str
    joint: str
    to: str
    along: float
    facing: tuple[str, ...]
    offset: float
    vertex: int | None = None
    within: float = WITHIN
    labels: tuple[str, ...] = ()


def next_joint(joint: str) -> str:
    """The end of the bone that starts at `joint`; for the wrist, the middle finger's knuckle."""
    if joint == "wrist":
        return "middle1"
    link = LINKS.index(joint)
    return TIPS[TIP_LINKS.index(link)] if link in TIP_LINKS else LINKS[link + 1]


def parse_places(text: str, source: str) -> tuple[MarkerPlace, ...]:
    """Read the YAML form of a marker set.

    A mapping `markers` from each name to its place, and optionally a common `offset`:

        offset: 0.005                 # metres from skin to marker centre, unless the marker says otherwise
        markers:
          index_pip: {joint: index2, facing: dorsal}
          hand_back: {joint: wrist, along: 0.5, facing: dorsal}     # towards middle1, unless `to` says otherwise
          thumb_nail: {joint: thumb3, along: 0.7, facing: [dorsal, radial]}
          index_nail: {vertex: 314}                                 # of one hand model only
          ring_nail: {joint: ring3, facing: dorsal, within: 0.005, labels: [RNAIL, 'ring.?tip']}

    `within`, which may also be common, says how exactly the place is known. A recording's label belongs to the marker
    of that name, or to the one that has a regular expression for it in `labels`.

    Raises:
        InputError: the text is not YAML or not of this form.
    """
    document = parse_yaml(text, source)
    if not isinstance(document, Mapping) or not isinstance(document.get("markers"), Mapping) or not document["markers"]:
        raise InputError(f"{source}: not a marker set; give a mapping `markers` from names to places")
    unknown = [key for key in document if key not in ("markers", "offset", "within")]
    if unknown:
        raise InputError(f"{source}: unknown entry {shown(unknown[0])}; valid are markers, offset, within")
    common = {"offset": document.get("offset"), "within": document.get("within", WITHIN)}
    return tuple(parse_place(str(name), entry, common, source) for name, entry in document["markers"].items())


def parse_place(name: str, entry: Any, common: Mapping[str, Any], source: str) -> MarkerPlace:
    """One marker's entry, checked."""
    where = f"{source}: marker {shown(name)}"
    if not isinstance(entry, Mapping):
        raise InputError(f"{where}: {shown(entry)} is not a place; give for example {{joint: index2, facing: dorsal}}")
    unknown = [key for key in entry if key not in KEYS]
    if unknown:
        raise InputError(f"{where}: unknown entry {shown(unknown[0])}; valid are {', '.join(KEYS)}")
    offset = number(where, "offset", entry.get("offset", common["offset"]), 0.05)
    within = number(where, "within", entry.get("within", common["within"]), 0.05)
    if within == 0:
        raise InputError(f"{where}: within is 0; give the metres by which its place may be off, such as {WITHIN}")
    labels = parse_labels(where, entry.get("labels", []))
    if "vertex" in entry:
        vertex = entry["vertex"]
        if isinstance(vertex, bool) or not isinstance(vertex, int) or vertex < 0 or {"joint", "facing"} & set(entry):
            raise InputError(f"{where}: give either a vertex, a number from 0, or joint and facing")
        return MarkerPlace(name, "", "", 0.0, (), offset, vertex, within, labels)
    joint = choice(where, "joint", entry.get("joint"), LINKS)
    to = entry.get("to", next_joint(joint))
    to = choice(where, "to", to, (*LINKS, *TIPS))
    facing = entry.get("facing")
    words = facing if isinstance(facing, list) and facing else [facing]
    directions = tuple(choice(where, "facing", word, tuple(DIRECTIONS)) for word in words)
    if not np.any(np.sum([DIRECTIONS[word] for word in directions], axis=0)):
        raise InputError(f"{where}: facing {', '.join(directions)} cancels out; give directions that differ")
    along = number(where, "along", entry.get("along", 0.0), 1.0)
    return MarkerPlace(name, joint, to, along, directions, offset, None, within, labels)


def parse_labels(where: str, value: Any) -> tuple[str, ...]:
    """Regular expressions, checked."""
    words = value if isinstance(value, list) else [value]
    return tuple(check_pattern(where, word) for word in words)


def choice(where: str, key: str, value: Any, valid: tuple[str, ...]) -> str:
    """`value` if it is one of the valid words."""
    if value not in valid:
        raise InputError(f"{where}: {key} is {shown(value)}; valid are {', '.join(valid)}")
    return value


def number(where: str, key: str, value: Any, most: float) -> float:
    """`value` if it is a number from 0 to `most`."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= most:
        raise InputError(f"{where}: {key} is {shown(value)}, expected a number from 0 to {most:g}")
    return float(value)


def skin_vertex(place: MarkerPlace, hand: HandModel) -> int:
    """The vertex nearest to where the ray from the bone, in the direction that the place faces, leaves the skin.

    Raises:
        InputError: the ray meets no skin, or the hand has no such vertex.
    """
    if place.vertex is not None:
        if place.vertex >= hand.num_vertices:
            raise InputError(
                f"marker {place.name!r}: vertex {place.vertex}, but {hand.name} has {hand.num_vertices}; "
                "the set is for another hand model"
            )
        return place.vertex
    template = np.asarray(hand.template, np.float64)
    centres = np.asarray(hand.joint_regressor, np.float64) @ template
    tips = template[np.asarray(hand.tip_vertices)]
    ends = {**dict(zip(LINKS, centres, strict=True)), **dict(zip(TIPS, tips, strict=True))}
    start, end = ends[place.joint], ends[place.to]
    direction = np.sum([DIRECTIONS[word] for word in place.facing], axis=0)
    if hand.side == "left":
        direction = direction * [-1.0, 1.0, 1.0]
    if place.joint != "wrist":  # at right angles to a phalanx, however it slopes
        bone = (end - start) / np.linalg.norm(end - start)
        direction = direction - (direction @ bone) * bone
    origin = start + place.along * (end - start)
    hit = first_hit(origin, direction / np.linalg.norm(direction), template[hand.faces])
    if hit is None:
        raise InputError(
            f"marker {place.name!r}: its place does not meet the skin of {hand.name}; check joint and facing"
        )
    face, point = hit
    corners = np.asarray(hand.faces)[face]
    return int(corners[np.argmin(np.linalg.norm(template[corners] - point, axis=1))])


def first_hit(
    origin: Float[np.ndarray, "3"], direction: Float[np.ndarray, "3"], triangles: Float[np.ndarray, "f 3 3"]
) -> tuple[int, Float[np.ndarray, "3"]] | None:
    """The first triangle that a ray crosses and the point where (Möller and Trumbore 1997); None if none."""
    edge1, edge2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(direction, edge2)
    determinant = np.einsum("fc,fc->f", edge1, p)
    inverse = 1 / np.where(np.abs(determinant) > 1e-15, determinant, np.inf)
    to_origin = origin - triangles[:, 0]
    u = np.einsum("fc,fc->f", to_origin, p) * inverse
    q = np.cross(to_origin, edge1)
    v = (q @ direction) * inverse
    distance = np.einsum("fc,fc->f", edge2, q) * inverse
    inside = (inverse != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
    if not inside.any():
        return None
    face = int(np.argmin(np.where(inside, distance, np.inf)))
    return face, origin + distance[face] * direction
