"""`MarkerSet`: which markers a hand wears, and where on its skin."""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from mjx_hand.capture.markers.marker_places import WITHIN, MarkerPlace, parse_places, skin_vertex
from mjx_hand.errors import InputError
from mjx_hand.files.text_table import read_lines
from mjx_hand.hand.model import HandModel

INCLUDED = ("hand22", "glove13")  # names of the sets that come with the project: YAML files beside this module


@dataclass(frozen=True)
class MarkerSet:
    """Markers resolved onto one hand.

    Attributes:
        names: the markers' labels in recordings.
        vertices: the hand vertex that each marker sits on.
        offsets: distance (m) of the marker's centre from the skin, along the vertex normal.
        within: standard deviation (m) of each component of where the marker really is; None for `WITHIN` each.
        labels: of each marker, regular expressions of other labels that recordings give it; empty for none at all.
    """

    names: tuple[str, ...]
    vertices: Int[np.ndarray, "m"]
    offsets: Float[np.ndarray, "m"]
    within: Float[np.ndarray, "m"] | None = None
    labels: tuple[tuple[str, ...], ...] = ()

    @property
    def place_deviation(self) -> Float[np.ndarray, "m"]:
        """`within`, or what it is taken for (m)."""
        return np.full(len(self.names), WITHIN) if self.within is None else self.within

    def __post_init__(self) -> None:
        repeated = sorted({n for n in self.names if self.names.count(n) > 1})
        if repeated:
            raise InputError(f"marker names repeat: {', '.join(repeated)}; give each marker its own name")
        if not (len(self.names) == len(self.vertices) == len(self.offsets) > 0):
            raise InputError(
                f"a marker set of {len(self.names)} names, {len(self.vertices)} vertices and "
                f"{len(self.offsets)} offsets; give one of each for every marker, and at least one marker"
            )
        bad = ~((np.asarray(self.offsets) >= 0) & (np.asarray(self.offsets) <= 0.05))
        if bad.any():
            at = int(np.argmax(bad))
            raise InputError(f"marker {self.names[at]!r}: offset {self.offsets[at]}, expected 0 to 0.05 metres")


def place_markers(places: tuple[MarkerPlace, ...], hand: HandModel) -> MarkerSet:
    """Resolve anatomical places onto this hand.

    Raises:
        InputError: a place does not meet this hand's skin, or two markers fall on one vertex.
    """
    vertices = [skin_vertex(place, hand) for place in places]
    for i, vertex in enumerate(vertices):
        if vertex in vertices[:i]:
            twin = places[vertices.index(vertex)].name
            raise InputError(
                f"markers {twin!r} and {places[i].name!r} both fall on vertex {vertex} of {hand.name}; move one of them"
            )
    return MarkerSet(
        names=tuple(place.name for place in places),
        vertices=np.array(vertices),
        offsets=np.array([place.offset for place in places]),
        within=np.array([place.within for place in places]),
        labels=tuple(place.labels for place in places),
    )


def load_marker_set(path: str | Path, hand: HandModel) -> MarkerSet:
    """The marker set of a YAML file (form: `marker_places.parse_places`), resolved onto `hand`.

    Args:
        path: of the file, or the name of an included set.
        hand: the hand that wears it.

    Raises:
        InputError: no such file, not YAML, not a marker set, or it does not fit this hand.
    """
    if str(path) in INCLUDED:
        return included_marker_set(hand, str(path))
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such marker set; give a YAML file, or one of {', '.join(INCLUDED)}")
    return place_markers(parse_places("\n".join(read_lines(path)), str(path)), hand)


def included_marker_set(hand: HandModel, name: str = "hand22") -> MarkerSet:
    """An included set, resolved onto `hand`: "hand22", of as many markers as arXiv 2512.07359 has, or "glove13"."""
    text = resources.files("mjx_hand.capture.markers").joinpath(f"{name}.yaml").read_text(encoding="utf-8")
    return place_markers(parse_places(text, name), hand)


def rest_offsets(marker_set: MarkerSet, hand: HandModel) -> Float[np.ndarray, "m 3"]:
    """Each marker's centre less its vertex (m, hand axes), on the mean shape at rest."""
    template, faces = np.asarray(hand.template, np.float64), np.asarray(hand.faces)
    corners = template[faces]
    area_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.stack([area_normals[(faces == v).any(axis=1)].sum(axis=0) for v in marker_set.vertices])
    return marker_set.offsets[:, None] * normals / np.linalg.norm(normals, axis=1, keepdims=True)
