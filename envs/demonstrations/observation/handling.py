"""Who moves an object, frame by frame, and which frames one hand can be asked to repeat."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import minimum_filter1d
from scipy.spatial import KDTree

from envs.demonstrations.observation.stillness import ObjectPath
from mjx_hand.capture.keypoints.skeleton import BONES
from mjx_hand.motion.gaps import fill_lines, spans
from mjx_hand.motion.motion import Motion
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.robots.motion_keypoints import motion_keypoints

RESTS, CARRIED, OTHER_HAND, UNTOUCHED, UNSEEN = range(5)
REASONS = {
    OTHER_HAND: "the other hand holds it",
    UNTOUCHED: "it moves and no hand is at it",
    UNSEEN: "hand or object was not seen",
}
AT_HAND = 0.03  # m from the middle of a finger to the surface: it may touch, with what capture errs
_LEVEL = 0.015  # m from a height at which it stood without a hand
_SLACK = 0.15  # s before and after, within which a hand counts as being there
_LONGEST_GAP, _FLICKER = 0.25, 0.1  # s that are bridged; s of another reason that is none
_STEADIER = 2.0  # as many times as steady as in the other hand, it is in this one
_LEAD, _AFTER, _REST = 2.0, 0.5, 0.2  # s before it is first moved, and after the last time; s of rest to begin with
MOVED = 0.02  # m: less is no manipulation


@dataclasses.dataclass(frozen=True)
class Manipulation:
    """Frames of a recording that one hand can repeat: an object rests, is moved by the hand, may rest again.

    Attributes:
        begin, end: first frame and the one behind the last.
        labels: of these frames: `RESTS` or `CARRIED`.
        left_out: reasons to the other frames, as first and last frame of each span.
    """

    begin: int
    end: int
    labels: Int[np.ndarray, "t"]
    left_out: Mapping[str, Sequence[tuple[int, int]]]


def hand_points(motion: Motion, rigid: RigidHand) -> Float[np.ndarray, "t 36 3"]:
    """Joints, tips and middles of bones in the scene's frame (m), gaps bridged."""
    points, bones = motion_keypoints(motion, rigid).positions, BONES.reshape(-1, 2)
    points = np.concatenate([points, (points[:, bones[:, 0]] + points[:, bones[:, 1]]) / 2], axis=1)
    return fill_lines(points, motion.valid)


def distances(
    points: Float[np.ndarray, "t k 3"], path: ObjectPath, surface: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "t"]:
    """How far (m) the nearest of a hand's points is from an object's surface."""
    there = _on_object(points, path)
    return KDTree(surface).query(there.reshape(-1, 3))[0].reshape(there.shape[:2]).min(axis=1)


def labelled(
    path: ObjectPath,
    height: Float[np.ndarray, "t"],
    hands: Sequence[tuple[Float[np.ndarray, "t"], Bool[np.ndarray, "t"], Float[np.ndarray, "t k 3"]]],
    fps: float,
) -> Int[np.ndarray, "t"]:
    """What each frame shows of an object, for the first of the hands.

    Args:
        path: the object's.
        height: of its lowest point (m).
        hands: of each its distance from the object, whether it was seen, and its points; the one that is asked for
            first.
        fps: frames per second.
    """
    slack = 2 * round(_SLACK * fps) + 1
    at = [minimum_filter1d(distance, slack, mode="nearest") < AT_HAND for distance, _, _ in hands]
    held = np.any(at, axis=0)
    rests = path.still & ~held
    levels = [np.median(height[a:b]) for a, b in spans(rests)]
    for a, b in spans(path.still):
        level = np.median(height[a:b])
        first = a == 0 and not levels
        if first or any(abs(level - known) < _LEVEL for known in levels):
            rests[a:b] = True
    labels = np.full(len(height), UNTOUCHED)
    labels[at[0]] = CARRIED
    if len(hands) > 1:
        ours, theirs = (_slip(path, points, fps) for _, _, points in hands)
        labels[at[1] & (~at[0] | (_STEADIER * theirs < ours))] = OTHER_HAND
    labels[rests] = RESTS
    unseen = ~hands[0][1] | ~path.seen
    for a, b in spans(unseen):
        if b - a > _LONGEST_GAP * fps or a == 0 or b == len(labels):
            labels[a:b] = UNSEEN
    for a, b in spans(labels > CARRIED):
        if b - a < _FLICKER * fps and a > 0 and b < len(labels) and labels[a] != UNSEEN:
            labels[a:b] = labels[a - 1]
    return labels


def longest_manipulation(
    labels: Int[np.ndarray, "t"], position: Float[np.ndarray, "t 3"], distance: Float[np.ndarray, "t"], fps: float
) -> Manipulation | str:
    """The longest manipulation among the frames, or why there is none.

    It begins with the object at rest and the hand off it, as much before it is moved as is there, up to two seconds.
    """
    best, why = None, "this hand never moves it"
    for a, b in spans(labels <= CARRIED):
        carried = a + np.flatnonzero(labels[a:b] == CARRIED)
        if not carried.size or np.linalg.norm(position[a:b] - position[a], axis=1).max() < MOVED:
            continue
        first = int(carried[0])
        if first - a < max(_REST * fps, 2):
            why = f"it is never seen at rest before the hand has it (frame {first})"
            continue
        begin, end = max(a, first - round(_LEAD * fps)), min(b, int(carried[-1]) + 1 + round(_AFTER * fps))
        if best is None or len(carried) > best[2]:
            best = begin, end, len(carried)
    if best is None:
        return why
    begin, end, _ = best
    left: dict[str, list[tuple[int, int]]] = {}
    outside = labels.copy()
    outside[begin:end] = RESTS
    for code, reason in REASONS.items():
        if found := [(a, b - 1) for a, b in spans(outside == code)]:
            left[reason] = found
    if found := [(a, b - 1) for a, b in spans(outside == CARRIED)]:
        left["another act of the same recording"] = found
    return Manipulation(begin, end, labels[begin:end], left)


def _on_object(points: Float[np.ndarray, "t k 3"], path: ObjectPath) -> Float[np.ndarray, "t k 3"]:
    """Points of the scene in the object's frame."""
    return np.einsum("tji,tkj->tki", path.rotation, points - path.position[:, None])


def _slip(path: ObjectPath, points: Float[np.ndarray, "t k 3"], fps: float) -> Float[np.ndarray, "t"]:
    """How fast (m/s) a hand's nearest points move along the object, over 0.3 s."""
    there = _on_object(points, path)
    half = max(round(_SLACK * fps), 1)
    frames = np.arange(len(there))
    before, after = np.maximum(frames - half, 0), np.minimum(frames + half, frames[-1])
    moved = np.linalg.norm(there[after] - there[before], axis=-1)
    return np.sort(moved, axis=1)[:, : moved.shape[1] // 2].mean(axis=1) * fps / np.maximum(after - before, 1)
