"""`KeypointReader`: what one form of keypoint file offers, and the list of all of them."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.files.contents import PICKLES
from mjx_hand.files.json_text import SUFFIXES
from mjx_hand.plugins import plugins

# What a file's suffix makes of its contents.
ARRAYS, VALUE, TABLE = "arrays", "value", "table"
CONTAINERS = {
    ARRAYS: (".npz", ".npy", *PICKLES),
    VALUE: SUFFIXES,
    TABLE: (".csv", ".tsv", ".txt"),
}


@dataclasses.dataclass(frozen=True)
class KeypointReader:
    """A form of keypoint file. A module of this package that names one `READER` adds it; nothing else needs an edit.

    Attributes:
        name: one line for people: what the form is called and what marks it.
        container: `ARRAYS`: the named values of an `.npz`, `.npy` or pickle; `VALUE`: that of a `.json` and its like;
            `TABLE`: a `files.delimited.Table`.
        recognises: whether contents are of this form.
        read: from path, contents and the unit that the caller says (or None) to a recording for each hand in it, by
            the hand's name in the file; raises InputError where the file is of the form but not sound.
    """

    name: str
    container: str
    recognises: Callable[[Any], bool]
    read: Callable[[Path, Any, str | None], dict[str, KeypointRecording]]


def keypoint_readers() -> list[KeypointReader]:
    """The `READER` of every module in `mjx_hand.capture.keypoint_files`, in the order of the modules' names."""
    return plugins("mjx_hand.capture.keypoint_files", "READER")
