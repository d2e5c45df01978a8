"""`load_keypoints`: one hand's keypoints from a file of any form that the project reads."""

import json
from pathlib import Path
from typing import Any

from mjx_hand.capture.keypoint_files.reader import KeypointReader, keypoint_readers
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.side import bent_side
from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import open_archive
from mjx_hand.pytree import replace


def load_keypoints(
    path: str | Path,
    *,
    side: str | None = None,
    sequence: str | None = None,
    fps: float | None = None,
    unit: str | None = None,
) -> KeypointRecording:
    """Read a keypoint file; its form is recognised from the file itself (`keypoints/files`, one module each).

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
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {found}; give the path of a keypoint file")
    contents = keypoint_contents(path)
    reader = recognised(path, contents)
    if reader is None:
        known = ", ".join(f"{each.name} {each.suffix}" for each in keypoint_readers())
        raise InputError(f"{path}: no keypoint file that is known here; read are {known}")
    recording = chosen(path, reader.read(path, contents, unit), side, sequence)
    if recording.fps is not None and fps not in (None, recording.fps):
        raise InputError(f"{path}: was recorded at {recording.fps:g} frames per second; leave out fps={fps:g}")
    return replace(recording, fps=recording.fps or fps)


def is_keypoint_file(path: str | Path) -> bool:
    """Whether `load_keypoints` reads this file.

    Raises:
        InputError: the file is damaged.
    """
    path = Path(path)
    return path.is_file() and recognised(path, keypoint_contents(path)) is not None


def keypoint_contents(path: Path) -> Any:
    """What the readers look at: an `.npz`'s arrays, a `.json`'s value, a `.csv`'s lines; None for other files.

    Raises:
        InputError: the file is damaged.
    """
    suffix = path.suffix.lower()
    if suffix == ".npz":
        return open_archive(path)
    if suffix not in (".json", ".csv"):
        return None
    try:
        text = path.read_text(encoding="utf-8-sig")
        return json.loads(text) if suffix == ".json" else [line for line in text.splitlines() if line.strip()]
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise InputError(f"{path}: not a readable {suffix} file ({str(error).splitlines()[0]})") from None


def recognised(path: Path, contents: Any) -> KeypointReader | None:
    """The reader for a file, or None."""
    if contents is None:
        return None
    readers = [reader for reader in keypoint_readers() if reader.suffix == path.suffix.lower()]
    return next((reader for reader in readers if reader.recognises(contents)), None)


def chosen(
    path: Path, hands: dict[str, KeypointRecording], side: str | None, sequence: str | None
) -> KeypointRecording:
    """The one hand that is meant.

    Raises:
        InputError: there are several and neither side nor name tells them apart, or none is of that side or name.
    """
    names = ", ".join(hands)
    if sequence is not None:
        if sequence not in hands:
            raise InputError(f"{path}: has no hand {sequence!r}; it has {names}")
        return hands[sequence]
    if len(hands) == 1:
        return next(iter(hands.values()))
    if side is None:
        raise InputError(f"{path}: holds {len(hands)} hands ({names}); choose with side= or sequence=")
    mine = {name: hand for name, hand in hands.items() if (hand.side or bent_side(hand.positions)) == side}
    if len(mine) != 1:
        found = f"{len(mine)} {side} hands ({', '.join(mine)})" if mine else f"no {side} hand among {names}"
        raise InputError(f"{path}: holds {found}; choose with sequence=, the hand's name")
    return next(iter(mine.values()))
