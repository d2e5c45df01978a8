"""What `mjx-hand info` says of a keypoint file, and the commands that read it: each was tried before it is advised."""

import itertools
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.load_keypoints import chosen, frames_seen
from mjx_hand.capture.keypoint_files.reader import KeypointReader
from mjx_hand.capture.keypoint_fit.fit import fit_keypoints
from mjx_hand.capture.keypoint_frames.one_hand import whole
from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.capture.keypoints.picture import picture_warning
from mjx_hand.capture.keypoints.plausible import keypoint_findings
from mjx_hand.capture.keypoints.recording import SIDES, KeypointRecording
from mjx_hand.capture.keypoints.side import known_side
from mjx_hand.cli.facts.facts_of import Facts, frames, share_missing
from mjx_hand.cli.terminal.wording import as_options
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.pytree import replace

BIGGEST_HAND = 1.0  # m; what is bigger is in another unit
USUAL_RATE = 30.0  # frames/s to advise where a file does not say
_UNITS = (None, "cm", "mm")  # to try where the file's own is no hand's

Hands = Mapping[str, KeypointRecording]


def keypoint_facts(
    path: Path, reader: KeypointReader, contents: Any, side: str | None, sequence: str | None, fps: float | None
) -> tuple[Facts, tuple[str, ...]]:
    """What is in a keypoint file, and commands that take it further: none where nothing reads it as it is.

    Args:
        path: of the file.
        reader: that recognises it.
        contents: what it looks at.
        side, sequence, fps: as `load_keypoints` takes them.

    Raises:
        InputError: the file is not sound.
    """
    hands = reader.read(path, contents, None)
    names = ("hands", ", ".join(f"{name} ({_seen(hands[name])})" for name in whole(hands)))
    try:
        found = chosen(path, hands, side, sequence)
    except InputError as error:
        advised = [_advice(path, reader, contents, hands, None, name, fps)[1] for name in whole(hands)]
        reason = as_options(str(error).removeprefix(f"{path}: "))
        return (names, ("to read one", reason)), tuple(itertools.chain(*advised))
    problem, commands = _advice(path, reader, contents, hands, side, sequence, fps)
    refused = (("to read it", problem),) if problem else ()
    rate = found.fps or fps
    unknown = f"at a rate that the file does not say; {USUAL_RATE:g}/s below is an example"
    counted = frames(found.num_frames, rate) if rate else ("frames", f"{found.num_frames}, {unknown}")
    findings = map(str, keypoint_findings(replace(found, fps=rate), load_hand()))
    doubts = dict.fromkeys((*found.warnings, *picture_warning(found.positions), *findings))
    warnings = tuple(("warning", doubt) for doubt in doubts)
    return (names, ("side", _side(found, side)), counted, *_points(found), *warnings, *refused), commands


def _seen(hand: KeypointRecording) -> str:
    seen = frames_seen(hand)
    return f"{seen} frames" if seen == hand.num_frames else f"{seen} of {hand.num_frames} frames"


def _side(found: KeypointRecording, asked: str | None) -> str:
    try:
        return " ".join(f"({text})" if k else text for k, text in enumerate(known_side(found, asked)))
    except InputError as error:
        return as_options(str(error).removeprefix(f"{found.source}: "))


def _points(found: KeypointRecording) -> Facts:
    seen = np.asarray(np.isfinite(found.positions).all(axis=-1))
    never = [KEYPOINTS[k] for k in np.flatnonzero(~seen.any(axis=0))]
    lacks = f", never {', '.join(never)}" if never else ""
    extent = np.nanmax(found.positions, axis=(0, 1)) - np.nanmin(found.positions, axis=(0, 1))
    across = np.ptp(found.positions[np.asarray(seen.any(axis=1))], axis=1)
    big = np.isfinite(across).any() and np.nanmedian(across.max(axis=-1)) > BIGGEST_HAND
    doubt = "; no hand is this large, give --unit to mjx-hand keypoints" if big else ""
    return (
        ("keypoints", f"{21 - len(never)} of 21, layout {found.layout}{lacks}"),
        ("gaps", share_missing(~seen[:, seen.any(axis=0)])),
        ("extent", f"{' x '.join(f'{e:.3g}' for e in extent)} m over all frames{doubt}"),
    )


def _advice(
    path: Path,
    reader: KeypointReader,
    contents: Any,
    hands: Hands,
    side: str | None,
    sequence: str | None,
    fps: float | None,
) -> tuple[str, tuple[str, ...]]:
    """Why the file cannot be read with the options that are known, and the commands with those that do read it."""
    problem = ""
    for which, unit in _choices(hands, side, sequence):
        try:
            read = hands if unit is None else reader.read(path, contents, unit)
            found = chosen(path, dict(read), which, sequence)
            rate = found.fps or fps or USUAL_RATE
            hand = load_hand(side=known_side(found, which)[0])
            fit_keypoints(replace(found, fps=rate), hand)
        except InputError as error:
            problem = problem or as_options(str(error).removeprefix(f"{path}: ").removeprefix(f"{path.name}: "))
            continue
        rate = fps if fps is not None else USUAL_RATE if found.fps is None else None
        said = {"side": which, "sequence": sequence, "fps": None if rate is None else f"{rate:g}"}
        options = "".join(f" --{name} {shlex.quote(value)}" for name, value in said.items() if value is not None)
        out = shlex.quote(f"{path.with_suffix('').name}.motion.npz")
        file = shlex.quote(str(path))
        of_unit = f" --unit {unit}" if unit is not None else ""
        view = (f"mjx-hand view {file}{options}",) if unit is None else ()
        return problem, (*view, f"mjx-hand keypoints {file} --out {out}{options}{of_unit}")
    return problem, ()


def _choices(hands: Hands, side: str | None, sequence: str | None) -> Iterator[tuple[str | None, str | None]]:
    """Sides and units to try, those that the caller and the file say first."""
    sides = (side,) if side is not None else (None, *SIDES)
    return itertools.chain(
        ((which, None) for which in sides), ((which, unit) for unit in _UNITS[1:] for which in sides)
    )
