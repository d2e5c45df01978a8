"""`DatasetFormat`: what one importer offers, what it is asked for, and the list of all of them."""

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from mjx_hand.motion import Motion, RecordedScene
from mjx_hand.plugins import plugins

Contents = Mapping[Any, Any]  # names, in some pickles frame numbers


@dataclasses.dataclass(frozen=True)
class Request:
    """What a caller says of a recording that the recording leaves open; None is unsaid.

    Attributes:
        side: "right" or "left", where both hands are recorded.
        sequence: the name of one recording, where a file or folder has several.
        mano: a licensed MANO file of that side, where poses are PCA coefficients or relative to MANO's mean pose, and
            for the wrist joint's own place; for a scene of both hands the folder of both files.
        fps: frames per second, where the recording does not say.
    """

    side: str | None = None
    sequence: str | None = None
    mano: Path | None = None
    fps: float | None = None


@dataclasses.dataclass(frozen=True)
class DatasetFormat:
    """A recording format. A module of this package that names one `FORMAT` adds it; nothing else needs an edit.

    Attributes:
        name: one line for people: what the format is called and, in brackets, what marks it.
        recognises: whether a file or folder is of this format, from its path and its contents: the named values of an
            `.npz`, or of the dictionary in a `.npy` or pickle, read without running it; else empty.
        read: the motion in it, as the request says; raises InputError where the file is of the format but not sound.
        has_sequences: whether `Request.sequence` chooses among several.
        read_scene: both hands, or the one that the request names, with the objects; None where a recording of this
            format has one hand and no object.
    """

    name: str
    recognises: Callable[[Path, Contents], bool]
    read: Callable[[Path, Contents, Request], Motion]
    has_sequences: bool = False
    read_scene: Callable[[Path, Contents, Request], RecordedScene] | None = None


def dataset_formats() -> list[DatasetFormat]:
    """The `FORMAT` of every module in `mjx_hand.capture.datasets`, in the order of the modules' names."""
    return plugins("mjx_hand.capture.datasets", "FORMAT")
