"""All recordings of a path as demonstrations that the twin carries, those that cannot be with their reasons."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from envs.demonstrations.from_recording.carry_trial import carry_trial
from envs.demonstrations.observation.solids import as_many
from envs.demonstrations.recordings.better_grasp import better_grasp
from envs.demonstrations.recordings.recorded_demonstration import Figures, Recorded, read_recording
from envs.demonstrations.recordings.recording_files import recordings_of
from envs.demonstrations.recordings.recording_settings import RecordingSettings
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.mirror import mirrored_demonstration
from mjx_hand.pytree import replace
from mjx_hand.retarget.hands import KinematicHands

ENOUGH = 0.9  # share of a demonstration up to which the twin must carry the object with nothing learned
PLAIN, SEARCHED = "as recorded, corrected", "another grasp near the recorded one was searched for"
Report = Callable[[str, float], None]


@dataclasses.dataclass(frozen=True)
class RecordedSet:
    """What n of the recordings at a path show, and why the others show nothing.

    Attributes:
        demonstrations, figures: of each recording.
        refused: names of the others, and why.
    """

    demonstrations: Sequence[Demonstration]
    figures: Sequence[Figures]
    refused: Sequence[tuple[str, str]]


def recorded_set(settings: RecordingSettings, report: Report = lambda what, share: None) -> RecordedSet:
    """A demonstration of each recording at `settings.path`, whose object the twin carries.

    Replayed in the engine first, as corrected; a grasp is searched only where that does not carry the object.

    Raises:
        InputError: there is none, or none of them can be used; with one recording, why.
    """
    paths = recordings_of(settings.path)
    found, refused = _readable(paths, settings, report)
    pieces = max((len(one.demonstration.object.hulls) for one in found), default=0)
    found = [
        dataclasses.replace(one, demonstration=_with_pieces(one.demonstration, pieces), figures=one.figures)
        for one in found
    ]
    report("trying what the hand carries", 0.9)
    if found:
        shares, lost = carry_trial([one.demonstration for one in found], [one.observed.hand for one in found])
    else:
        shares, lost = np.zeros(0), np.zeros(0, int)
    demonstrations, figures = [], []
    for one, share, frame in zip(found, shares, lost, strict=True):
        whole = one.demonstration.num_frames
        told = dataclasses.replace(
            one.figures, carried=float(share), lost=None if frame >= whole else int(frame), road=PLAIN
        )
        if share >= ENOUGH:
            demonstrations.append(one.demonstration)
            figures.append(told)
            continue
        try:
            better, told = better_grasp(one, told, settings, report)
        except InputError as error:
            first = one.figures.first + round(frame * one.figures.rate / settings.rate)
            refused.append((one.figures.name, f"the twin loses the object in frame {first}, and {error}"))
            continue
        demonstrations.append(better)
        figures.append(dataclasses.replace(told, road=SEARCHED))
    demonstrations, figures = of_one_hand(demonstrations, figures)
    if not demonstrations:
        raise InputError(_none(settings.path, refused))
    return RecordedSet(demonstrations, figures, refused)


def _readable(
    paths: Sequence[Path], settings: RecordingSettings, report: Report
) -> tuple[list[Recorded], list[tuple[str, str]]]:
    hands, found, refused = KinematicHands(), [], []
    for k, path in enumerate(paths):
        report(f"reading {path.name}", 0.9 * k / len(paths))
        try:
            found.append(read_recording(path, settings, hands))
        except InputError as error:
            if len(paths) == 1:
                raise
            refused.append((path.stem, str(error)))
    return found, refused


def of_one_hand(
    demonstrations: Sequence[Demonstration], figures: Sequence[Figures]
) -> tuple[list[Demonstration], list[Figures]]:
    """All by the hand that most are of, the others as mirror images: a policy is one hand's."""
    sides = [d.motion.side for d in demonstrations]
    most = "left" if sides.count("left") > sides.count("right") else "right"
    other = [side != most for side in sides]
    return (
        [mirrored_demonstration(d) if turn else d for d, turn in zip(demonstrations, other, strict=True)],
        [dataclasses.replace(f, mirrored=turn) for f, turn in zip(figures, other, strict=True)],
    )


def _with_pieces(demonstration: Demonstration, pieces: int) -> Demonstration:
    described = demonstration.object
    return replace(demonstration, object=replace(described, hulls=as_many(described.hulls, pieces)))


def _none(path: str, refused: Sequence[tuple[str, str]]) -> str:
    if len(refused) == 1:
        return f"{path}: {refused[0][1]}"
    return f"{path}: none of {len(refused)} recordings can be used; the first, {refused[0][0]}: {refused[0][1]}"
