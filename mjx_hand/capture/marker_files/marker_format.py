"""`MarkerFormat`: what one reader of marker files offers, and the list of all of them."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.plugins import plugins


@dataclasses.dataclass(frozen=True)
class MarkerFormat:
    """A marker file format. A module of this package that names one `FORMAT` adds it; nothing else needs an edit.

    Attributes:
        name: one line for people: what the format is called and what marks it.
        suffixes: of its files, in lower case.
        read: the recording in a file, from its path, a unit to read it in instead of the file's own (or None), and its
            frames per second where it does not say them (or None). Raises InputError where the file is not sound.
        begins: how its text begins, where formats share a suffix; one without is asked last.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, str | None, float | None], MarkerRecording]
    begins: str = ""


def marker_formats() -> list[MarkerFormat]:
    """The `FORMAT` of every module in `mjx_hand.capture.marker_files`, in the order of the modules' names."""
    return plugins("mjx_hand.capture.marker_files", "FORMAT")
