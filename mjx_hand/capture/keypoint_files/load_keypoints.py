"""`load_keypoints`: one hand's keypoints from a file of any form that the project reads."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.reader import ARRAYS, CONTAINERS, TABLE, KeypointReader, keypoint_readers
from mjx_hand.capture.keypoint_frames.one_hand import whole
from mjx_hand.capture.keypoints.picture import picture_warning
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.side import bent_side
from mjx_hand.errors import InputError
from mjx_hand.files.contents import read_contents
from mjx_hand.files.delimited import read_table
from mjx_hand.files.describe import described
from mjx_hand.files.input_file import check_input_file
from mjx_hand.files.json_text import read_json
from mjx_hand.pytree import replace

FEW = 0.1  # share of the other hand's frames below which a hand is taken for a mistake of the tracker
NEAREST = (
    "keypoints are 21 points a hand (or another device's) in each frame: `joints` (frames, points, 3) in an .npz, "
    "frames of points or of joints by name in a .json, columns NAME_x, NAME_y, NAME_z in a .csv"
)


def load_keypoints(
    path: str | Path,
    *,
    side: str | None = None,
    sequence: str | None = None,
    fps: float | None = None,
    unit: str | None = None,
) -> KeypointRecording:
    """Read a keypoint file; its form is recognised from the file itself (`keypoint_files`, one module each).

    Args:
        path: the file.
        side: "right" or "left", where the file holds both hands or does not say which it holds.
        sequence: the name of one hand in the file, where there are several.
        fps: frames per second, where the file does not say.
        unit: "m", "cm" or "mm", where the file does not say.

    Raises:
        InputError: no such file, no form recognises it, it is not sound, or the hand is not told apart.
    """
    path = Path(path)
    check_input_file(path, "give the path of a keypoint file")
    contents = keypoint_contents(path)
    reader = recognised(path, contents)
    if reader is None:
        raise InputError(f"{path}: no keypoint file that is known here, but {described(path, contents)}; {NEAREST}")
    recording = chosen(path, reader.read(path, contents, unit), side, sequence)
    if recording.fps is not None and fps not in (None, recording.fps):
        raise InputError(f"{path}: was recorded at {recording.fps:g} frames per second; leave out fps={fps:g}")
    warnings = (*recording.warnings, *picture_warning(recording.positions))
    return replace(recording, fps=recording.fps or fps, warnings=warnings)


def is_keypoint_file(path: str | Path) -> bool:
    """Whether `load_keypoints` reads this file; False for a folder and for what is no regular file.

    Raises:
        InputError: the file is damaged.
    """
    path = Path(path)
    return path.is_file() and recognised(path, keypoint_contents(path)) is not None


def container_of(path: Path) -> str:
    """In which container the file is, by its suffix: a key of `reader.CONTAINERS`, or ""."""
    suffix = path.suffix.lower()
    return next((container for container, suffixes in CONTAINERS.items() if suffix in suffixes), "")


def keypoint_contents(path: Path, known: Mapping[str, Any] | None = None) -> Any:
    """What the readers look at: named arrays, a JSON value, or a table; None for other files.

    Args:
        path: of the file.
        known: what `read_contents` found in it, where it was asked before.

    Raises:
        InputError: the file is damaged, or the pointer that Git LFS leaves.
    """
    container = container_of(path)
    if not container:
        return None
    check_input_file(path, "give the path of a recording")
    if container == ARRAYS:
        return read_contents(path) if known is None else known
    return read_table(path) if container == TABLE else read_json(path)


def recognised(path: Path, contents: Any) -> KeypointReader | None:
    """The reader for a file, or None."""
    if contents is None:
        return None
    readers = [reader for reader in keypoint_readers() if reader.container == container_of(path)]
    return next((reader for reader in readers if reader.recognises(contents)), None)


def chosen(
    path: Path, hands: dict[str, KeypointRecording], side: str | None, sequence: str | None
) -> KeypointRecording:
    """The one hand that is meant.

    Parts of a hand that was lost and found again are chosen by name alone. Hands that are hardly ever seen, which are
    mistakes of a tracker, do not count.

    Raises:
        InputError: there are several and neither side nor name tells them apart, or none is of that side or name.
    """
    if sequence is not None:
        if sequence not in hands:
            raise InputError(f"{path}: has no hand {sequence[:60]!r}; it has {', '.join(hands)}")
        return hands[sequence]
    hands = {name: hands[name] for name in whole(hands)}
    names = ", ".join(hands)
    if len(hands) == 1:
        return next(iter(hands.values()))
    mine = hands
    if side is not None:
        mine = {name: hand for name, hand in hands.items() if (hand.side or bent_side(hand.positions)) == side}
    often = _often(mine)
    if len(often) == 1:
        return next(iter(often.values()))
    if side is None:
        raise InputError(f"{path}: holds {len(hands)} hands ({names}); choose with side= or sequence=")
    found = f"{len(often)} {side} hands ({', '.join(often)})" if often else f"no {side} hand among {names}"
    raise InputError(f"{path}: holds {found}; choose with sequence=, the hand's name")


def _often(hands: dict[str, KeypointRecording]) -> dict[str, KeypointRecording]:
    """Those of several hands that are seen often; each says which others were left out."""
    seen = {name: frames_seen(hand) for name, hand in hands.items()}
    few = [name for name, count in seen.items() if count < FEW * max(seen.values())]
    left_out = ", ".join(f"{name} in {seen[name]} of {hands[name].num_frames}" for name in few)
    warnings = (f"left out what is seen in few frames: {left_out}",) if few else ()
    return {
        name: replace(hand, warnings=(*hand.warnings, *warnings)) for name, hand in hands.items() if name not in few
    }


def frames_seen(hand: KeypointRecording) -> int:
    """In how many frames any keypoint of a hand is there."""
    return int(np.isfinite(hand.positions).all(axis=-1).any(axis=-1).sum())
