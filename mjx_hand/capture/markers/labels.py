"""Which of a recording's labels are which markers of a set."""

from dataclasses import dataclass

import numpy as np

from mjx_hand.capture.markers.label_patterns import matches
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.capture.markers.marker_set import MarkerSet
from mjx_hand.errors import InputError
from mjx_hand.pytree import replace


@dataclass(frozen=True)
class Labelled:
    """A recording of the set's markers alone, under the set's names.

    Attributes:
        recording: the markers of the set that it has.
        missing: the set's markers that it lacks, or that are never seen.
        others: labels that are no marker of the set.
    """

    recording: MarkerRecording
    missing: tuple[str, ...]
    others: tuple[str, ...]


def match_labels(recording: MarkerRecording, marker_set: MarkerSet, prefix: str = "") -> Labelled:
    """Pick out a set's markers: by name, or by the regular expressions that the set has for it.

    A subject's name before a colon, as Vicon writes it, does not count; neither does the case of letters.

    Args:
        recording: as it was read.
        marker_set: the markers to look for.
        prefix: look only at labels that start with this, and match what follows it.

    Raises:
        InputError: no label matches, or two labels are one marker, as where two hands are in one file.
    """
    found: dict[str, list[str]] = {name: [] for name in marker_set.names}
    for label in recording.names:
        if not label.lower().startswith(prefix.lower()):
            continue
        rest = label[len(prefix) :]
        marker = marker_of(rest, marker_set) or marker_of(rest.rsplit(":", 1)[-1], marker_set)
        if marker is not None:
            found[marker].append(label)
    name = recording.source or "recording"
    for marker, labels in found.items():
        if len(labels) > 1:
            raise InputError(
                f"{name}: labels {' and '.join(map(repr, labels))} are both marker {marker!r}; are there two hands? "
                "choose one by what its labels start with: --prefix"
            )
    chosen = {marker: labels[0] for marker, labels in found.items() if labels}
    if not chosen:
        raise InputError(f"{name}: {_no_match(recording.names, marker_set, prefix)}")
    place = {label: k for k, label in enumerate(recording.names)}
    at = [place[label] for label in chosen.values()]
    picked = replace(
        recording, positions=recording.positions[:, at], visible=recording.visible[:, at], names=tuple(chosen)
    )
    never = [marker for marker, seen in zip(chosen, picked.visible.any(axis=0), strict=True) if not seen]
    return Labelled(
        recording=picked,
        missing=tuple(marker for marker in marker_set.names if marker not in chosen or marker in never),
        others=tuple(np.delete(np.array(recording.names, dtype=object), at)),
    )


def marker_of(label: str, marker_set: MarkerSet) -> str | None:
    """The marker that a label names, or None."""
    for marker in marker_set.names:
        if label.lower() == marker.lower():
            return marker
    for marker, patterns in zip(marker_set.names, marker_set.labels, strict=False):
        if any(matches(pattern, label) for pattern in patterns):
            return marker
    return None


def label_starts(labels: tuple[str, ...], marker_set: MarkerSet) -> tuple[str, ...]:
    """What labels have before a marker's name: the subject's, or the side's."""
    found = {label[: -len(n)] for label in labels for n in marker_set.names if label.lower().endswith(n.lower())}
    return tuple(sorted(found - {""}))


def _no_match(labels: tuple[str, ...], marker_set: MarkerSet, prefix: str) -> str:
    """What is wrong where no label matches: often all begin with the subject's or the side's name."""
    starts = ", ".join(map(repr, label_starts(labels, marker_set)))
    if prefix:
        return f"no label is {prefix!r} and a marker of the set" + (f"; some begin with {starts}" if starts else "")
    shown = ", ".join(labels[:6]) + (" and more" if len(labels) > 6 else "")
    if starts:
        return f"no label is one of the marker set's, but some are after {starts}: say --prefix"
    return f"none of its labels ({shown}) is in the marker set ({', '.join(marker_set.names[:6])}, ...)"
