"""From the hands that a tracker lists frame by frame to a recording of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoint_frames.frame_hand import IMAGE, WORLD, FrameHand
from mjx_hand.capture.keypoint_frames.one_hand import found_again, name_of, never_at_once, with_parts
from mjx_hand.capture.keypoint_frames.timed_hand import timed_hand
from mjx_hand.capture.keypoint_frames.tracks import tracks, usual
from mjx_hand.capture.keypoints.names import counted_keypoints, named_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.side import bent_side
from mjx_hand.capture.keypoints.size import unit_factor
from mjx_hand.capture.timeline.timeline import Timeline
from mjx_hand.errors import InputError

Array = np.ndarray
FEW_BROKEN = 0.1  # share of the hands seen that may have another number of points, and are left out


@dataclass(frozen=True)
class _Seen:
    """All hands of a file, one after another: their frames, and what is known of each."""

    frames: list[int]
    hands: list[FrameHand]
    positions: Float[Array, "n 21 3"]
    layout: str


def recordings(
    path: Path, frames: Sequence[Sequence[FrameHand]], timeline: Timeline, said: Mapping[str, Any], unit: str | None
) -> dict[str, KeypointRecording]:
    """A recording for each hand that is in the frames, by its name in the file.

    A hand that was lost and found again is one. Hands with another number of points than nearly all others are left
    out, with a warning.

    Args:
        path: of the file.
        frames: the hands in each frame.
        timeline: when they were taken.
        said: what else the file says of all of them: `side`, `unit`, `layout`.
        unit: what the caller says, or None.

    Raises:
        InputError: no hand is there, or a hand's joints or the file's unit or times are not sound.
    """
    seen, warnings = _seen(path, frames, said.get("layout"))
    scale = unit_factor(str(path), unit or said.get("unit") or seen.hands[0].unit or "m")
    sides, labels = [hand.side for hand in seen.hands], [hand.label for hand in seen.hands]
    lost = (seen.positions == 0).all(axis=-1, keepdims=True)  # places that would lead astray
    found = tracks(seen.frames, sides, labels, np.where(lost, np.nan, seen.positions))
    names = _names([usual([labels[k] for k in track]) for track in found])
    indices = dict(zip(names, found, strict=True))
    side = {name: usual([sides[k] for k in track]) for name, track in indices.items()}
    if len(found) == 1 and not side[names[0]]:
        side[names[0]] = str(said.get("side") or "").lower()
    at = {name: [seen.frames[k] for k in track] for name, track in indices.items()}
    known = {name: side[name] or bent_side(seen.positions[track]) for name, track in indices.items()}
    there = {name: np.isin(np.arange(len(frames)), rows) for name, rows in at.items()}
    made = {}
    for group in with_parts(never_at_once(there, known)):
        name = name_of(group)
        positions = np.full((len(frames), *seen.positions.shape[1:]), np.nan)
        for each in group:
            positions[at[each]] = seen.positions[indices[each]]
        told = (*warnings, *found_again(group))
        source = path.name if len(found) == 1 else f"{path.name} {name}"
        made[name] = timed_hand(
            path,
            scale * positions,
            timeline,
            side=side[group[0]],
            layout=seen.layout,
            source=source,
            warnings=told,
        )
    return made


def _names(labels: list[str]) -> list[str]:
    """A name of its own for each hand: what the file calls it, with a number where it calls two so."""
    names: list[str] = []
    for label in labels:
        name, number = label or "hand", 1
        while name in names:
            number += 1
            name = f"{label or 'hand'}_{number}"
        names.append(name)
    return names


def _seen(path: Path, frames: Sequence[Sequence[FrameHand]], layout: object) -> tuple[_Seen, tuple[str, ...]]:
    listed = [(k, hand) for k, hands in enumerate(frames) for hand in hands]
    forms = {hand.form for _, hand in listed}
    if WORLD in forms:
        listed = [(k, hand) for k, hand in listed if hand.form == WORLD]
    elif IMAGE in forms:
        raise InputError(
            f"{path}: holds MediaPipe's landmarks of the image, which are shares of its width and height, no places; "
            "save the world landmarks (worldLandmarks, multi_hand_world_landmarks), which are metres"
        )
    if not listed:
        raise InputError(f"{path}: all {len(frames)} frames are gaps; no hand was seen")
    kept, points, names = _stacked(path, listed)
    points[~np.isfinite(points)] = np.nan
    positions, name = named_keypoints(path, names, points) if names else counted_keypoints(path, points, layout)
    seen = _Seen([k for k, _ in kept], [hand for _, hand in kept], positions, name)
    lost = (
        [k for k, hand in listed if not any(hand is other for other in seen.hands)] if len(kept) < len(listed) else []
    )
    if not lost:
        return seen, ()
    return seen, (f"{len(lost)} hands left out that have other points than most, first in frame {lost[0]}",)


def _stacked(
    path: Path, listed: list[tuple[int, FrameHand]]
) -> tuple[list[tuple[int, FrameHand]], Float[Array, "n p 3"], list[str]]:
    """Those hands that have points like most, these points, and their names, if they have any."""
    kinds = [0 if hand.names else len(hand.points) for _, hand in listed]
    kind = usual(kinds)
    kept = [each for each, other in zip(listed, kinds, strict=True) if other == kind]
    if len(listed) - len(kept) > FEW_BROKEN * len(listed):
        _, hand = listed[0]
        other, odd = next(each for each, its in zip(listed, kinds, strict=True) if its != kinds[0])
        raise InputError(
            f"{path}: frame {other} has {len(odd.points)} points where the first has {len(hand.points)}; "
            "give every frame the same"
        )
    if kind > 0:
        return kept, np.stack([hand.points for _, hand in kept]), []
    names = list(dict.fromkeys(name for _, hand in kept for name in hand.names))
    row = {name: k for k, name in enumerate(names)}
    points = np.full((len(kept), len(names), 3), np.nan)
    for k, (_, hand) in enumerate(kept):
        if len(set(hand.names)) < len(hand.names):
            named_keypoints(path, hand.names, hand.points)  # says which joint is there twice
        points[k, [row[name] for name in hand.names]] = hand.points
    return kept, points, names
