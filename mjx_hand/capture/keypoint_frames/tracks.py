"""Hands followed from frame to frame: by the name that can be trusted, else by how they bend and where they are.

Trackers list hands in any order, label a hand now left and now right, see one twice or two under one label. A hand's
fingers bend to one side only, and it moves little from one frame to the next; both tell more than lists and labels.
"""

from collections import Counter
from collections.abc import Hashable, Sequence
from typing import TypeVar

import numpy as np
from jaxtyping import Float
from scipy.optimize import linear_sum_assignment

from mjx_hand.capture.keypoints.side import bends_towards_right

T = TypeVar("T", bound=Hashable)

_SURE = 0.2  # mean bend (rad) from which a single frame tells right from left
_OTHER_LABEL = 0.3  # what another label costs, in hand's lengths of way
_FARTHEST = 2.0  # hand's lengths beyond which a way counts no more: it was lost and found elsewhere
_NEW = 5.0  # what one more hand costs
_OTHER_SIDE = 10.0  # what bending to the other side costs: more than to be one more hand


def tracks(
    frames: Sequence[int], sides: Sequence[str], labels: Sequence[str], positions: Float[np.ndarray, "n 21 3"]
) -> list[list[int]]:
    """Which of all the hands that were seen are one and the same, as lists of their indices.

    Args:
        frames: of each hand seen, its frame's number, ascending.
        sides: of each, "" where not to be trusted.
        labels: of each, as the file calls it. Hands of known side are told apart by it.
        positions: of each, in any unit.
    """
    told = list(zip(sides, labels, strict=True))
    once = len(set(zip(frames, told, strict=True))) == len(frames)
    if once and (all(sides) or len(set(told)) == 1):
        return [[k for k, each in enumerate(told) if each == name] for name in dict.fromkeys(told)]
    bends = np.clip(np.nan_to_num(bends_towards_right(positions)), -0.5, 0.5)
    known = np.isfinite(positions)
    spans = np.where(known, positions, -np.inf).max(axis=1) - np.where(known, positions, np.inf).min(axis=1)
    spans = np.maximum(spans.max(axis=1), 0.0)

    def cost(hand: int, track: list[int], bend: float) -> float:
        last = track[-1]
        trusted = bool(sides[hand] and sides[last])
        if trusted and told[hand] != told[last]:
            return 2 * _OTHER_SIDE
        way = np.linalg.norm(positions[hand] - positions[last], axis=-1)
        way = way[np.isfinite(way)]
        far = float(way.mean() / max(spans[hand], spans[last], 1e-12)) if len(way) else _FARTHEST
        conflict = not trusted and min(abs(bends[hand]), abs(bend)) > _SURE and bends[hand] * bend < 0
        other = labels[hand] != labels[last]
        return min(far, _FARTHEST) + (_OTHER_LABEL if other else 0) + (_OTHER_SIDE if conflict else 0)

    found: list[list[int]] = []
    mean_bends: list[float] = []
    begin = 0
    while begin < len(frames):
        end = begin + 1
        while end < len(frames) and frames[end] == frames[begin]:
            end += 1
        group = range(begin, end)
        costs = np.full((len(group), len(found) + len(group)), _NEW)
        for row, hand in enumerate(group):
            costs[row, : len(found)] = [cost(hand, track, bend) for track, bend in zip(found, mean_bends, strict=True)]
        for row, column in zip(*linear_sum_assignment(costs), strict=True):
            hand = begin + int(row)
            if column < len(found):
                track = found[column]
                mean_bends[column] += (float(bends[hand]) - mean_bends[column]) / (len(track) + 1)
                track.append(hand)
            else:
                found.append([hand])
                mean_bends.append(float(bends[hand]))
        begin = end
    return found


def usual(values: Sequence[T]) -> T:
    """The value that is there most often, the first of several."""
    return Counter(values).most_common(1)[0][0]
