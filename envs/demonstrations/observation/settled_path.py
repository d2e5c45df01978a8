"""An object's way without what cannot have been: it stands flat and still where it rests, and does not jump."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from envs.demonstrations.observation.handling import CARRIED, RESTS
from envs.demonstrations.observation.solids import Solid
from envs.demonstrations.observation.stillness import ObjectPath, mean_rotations
from mjx_hand.motion.gaps import fill_turns, spans
from mjx_hand.motion.resample import matrix_quaternions, quaternion_matrices
from mjx_hand.smoothstep import smoothstep

_UP = np.array([0.0, 0.0, 1.0])
_LEANS = np.deg2rad(20.0)  # what stands further than this from flat leans on something
_ONE_LEVEL = 0.008  # m: heights nearer than this are one support
_FADE = 0.4  # s in which the correction of a rest goes over into the recorded way
_SAME = np.deg2rad(25.0)  # an object seen turned more than this in a hand that holds it was not seen rightly
_JUMP, _OF_NOISE, _ROUNDS = np.deg2rad(15.0), 6.0, 5
_FOOT, _MARGIN = 0.004, 0.01  # m: of what stands on a support; that the support reaches beyond it


@dataclasses.dataclass(frozen=True)
class Rest:
    """Where an object stands still; frames, metres, world frame (z up, the lowest support at 0).

    Attributes:
        begin, end: first frame and the one behind the last.
        position, rotation: of the object.
        level: height of what it stands on.
        stand: up in its own frame, if it stands flat on one of its faces.
    """

    begin: int
    end: int
    position: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    level: float
    stand: Float[np.ndarray, "3"] | None


@dataclasses.dataclass(frozen=True)
class SettledPath:
    """An object's way in the world, and what was added to the recording for it; metres.

    Attributes:
        position, rotation: of the object.
        moved, turned: added to the recorded place, and to the orientation, about the object's place (world axes).
        origin: of the world in the recording's place, below where the object first rests; taken from all places.
        rests: where it stands.
        bridged: frames whose orientation was not believed.
    """

    position: Float[np.ndarray, "t 3"]
    rotation: Float[np.ndarray, "t 3 3"]
    moved: Float[np.ndarray, "t 3"]
    origin: Float[np.ndarray, "3"]
    turned: Float[np.ndarray, "t 3 3"]
    rests: Sequence[Rest]
    bridged: int


def settled_path(
    path: ObjectPath,
    labels: Int[np.ndarray, "t"],
    hand_rotation: Float[np.ndarray, "t 3 3"],
    solid: Solid,
    fps: float,
) -> SettledPath:
    """The object's way, z up, shifted so that it first rests above the origin and the lowest support is at z = 0.

    Args:
        path: recorded, in axes of which z is up.
        labels: `RESTS` or `CARRIED`; the first frame rests.
        hand_rotation: of the hand that carries it.
        solid: its surface.
        fps: frames per second.
    """
    good = _credible(path, labels, hand_rotation)
    rotation = _bridged(path.rotation, good)
    rests = _rests(path, rotation, labels, solid)
    if path.noisy:  # from how it stands to how it lies in the hand by the shortest turn
        known = path.rotation.copy()
        for rest in rests:
            known[rest.begin : rest.end] = rest.rotation
        rotation = _bridged(known, good | (labels == RESTS))
    low = min(rest.level for rest in rests)
    origin = np.array([*rests[0].position[:2], low])
    moved, turned = np.zeros((len(labels), 3)), np.tile(np.eye(3), (len(labels), 1, 1))
    shares = _shares(rests, len(labels), fps)
    place, turn = path.position.copy(), rotation.copy()
    for rest, share in zip(rests, shares, strict=True):
        span = slice(rest.begin, rest.end)
        recorded = np.median(path.position[span], axis=0)
        moved += share[:, None] * (rest.position - recorded)
        if not path.noisy:
            mean = mean_rotations(rotation[span], 2 * (rest.end - rest.begin) + 1)[(rest.end - rest.begin) // 2]
            arc = Rotation.from_matrix(rest.rotation @ mean.T).as_rotvec()
            turned = Rotation.from_rotvec(share[:, None] * arc).as_matrix() @ turned
    for rest in rests:
        span = slice(rest.begin, rest.end)
        place[span] = rest.position - moved[span]
        turn[span] = np.swapaxes(turned[span], 1, 2) @ rest.rotation
    lowered = [dataclasses.replace(r, position=r.position - origin, level=r.level - low) for r in rests]
    return SettledPath(
        position=place + moved - origin,
        rotation=turned @ turn,
        moved=moved,
        origin=origin,
        turned=turned,
        rests=lowered,
        bridged=int((~good & (labels == CARRIED)).sum()),
    )


def support_boxes(rests: Sequence[Rest], solid: Solid) -> tuple[Float[np.ndarray, "b 3"], Float[np.ndarray, "b 3"]]:
    """Half extents and centres (m) of a box under each rest that is higher than the table."""
    halves, centres = [], []
    for rest in rests:
        if rest.level < _ONE_LEVEL:
            continue
        corners = solid.outline @ rest.rotation.T + rest.position
        foot = corners[corners[:, 2] < corners[:, 2].min() + _FOOT][:, :2]
        low, high = foot.min(axis=0) - _MARGIN, foot.max(axis=0) + _MARGIN
        halves.append([*(high - low) / 2, rest.level / 2])
        centres.append([*(high + low) / 2, rest.level / 2])
    return np.array(halves).reshape(-1, 3), np.array(centres).reshape(-1, 3)


def held_rotation(turned: Rotation) -> tuple[Rotation, Bool[np.ndarray, "n"]]:
    """The mean of how an object lies in a hand, of those that most are near to, and which these are."""
    off = np.stack([(one.inv() * turned).magnitude() for one in turned])
    mean = turned[int(np.argmin(np.minimum(off, _SAME).sum(axis=1)))]
    for _ in range(_ROUNDS):
        mean = turned[(mean.inv() * turned).magnitude() < _SAME].mean()
    return mean, (mean.inv() * turned).magnitude() < _SAME


def shortest_turn(before: Float[np.ndarray, "3"], after: Float[np.ndarray, "3"], share: float = 1.0) -> Rotation:
    """The shortest turn from one unit vector onto another, or a share of it."""
    turn = np.cross(before, after)
    size = np.linalg.norm(turn)
    return Rotation.from_rotvec(share * np.arctan2(size, before @ after) * turn / max(size, 1e-12))


def _credible(path: ObjectPath, labels: Int[np.ndarray, "t"], hand: Float[np.ndarray, "t 3 3"]) -> np.ndarray:
    """Frames whose orientation may be right: all, but for jumps; of a noisy recording those in which the object lies
    in the hand as it mostly does while it is carried, for a grasp does not slip."""
    good = np.ones(len(labels), bool)
    if not path.noisy:
        steps = Rotation.from_matrix(np.swapaxes(path.rotation[:-1], 1, 2) @ path.rotation[1:]).magnitude()
        jump = steps > max(_JUMP, _OF_NOISE * path.turn_noise)
        good[1:-1] = ~(jump[:-1] & jump[1:])
        return good
    for a, b in spans(labels == CARRIED):
        lies = Rotation.from_matrix(np.swapaxes(hand[a:b], 1, 2) @ path.rotation[a:b])
        good[a:b] = held_rotation(lies)[1]
    good[labels == RESTS] = False
    return good if good.any() else np.ones(len(labels), bool)


def _bridged(rotation: Float[np.ndarray, "t 3 3"], good: np.ndarray) -> Float[np.ndarray, "t 3 3"]:
    return rotation if good.all() else quaternion_matrices(fill_turns(matrix_quaternions(rotation), good))


def _rests(path: ObjectPath, rotation: np.ndarray, labels: np.ndarray, solid: Solid) -> list[Rest]:
    found = []
    for a, b in spans(labels == RESTS):
        middle = (a + b) // 2
        mean = rotation[middle] if path.noisy else mean_rotations(rotation[a:b], 2 * (b - a) + 1)[(b - a) // 2]
        flat, stand = _flat(mean, path.rotation[a:b, 2].mean(axis=0), solid)
        place = np.median(path.position[a:b], axis=0)
        level = float(np.median(path.position[a:b, 2] + solid.lowest(rotation[a:b], _UP)))
        found.append(Rest(a, b, place, flat, level, stand))
    heights = np.sort([rest.level for rest in found])
    groups = np.split(heights, np.flatnonzero(np.diff(heights) > _ONE_LEVEL) + 1)
    out = []
    for rest in found:
        level = next(float(group.mean()) for group in groups if group[0] <= rest.level <= group[-1])
        place = rest.position.copy()
        place[2] = level - solid.lowest(rest.rotation, _UP)
        out.append(dataclasses.replace(rest, position=place, level=level))
    return out


def _flat(rotation: np.ndarray, up: np.ndarray, solid: Solid) -> tuple[np.ndarray, np.ndarray | None]:
    """The orientation nearest to one in which it stands flat on a face, and up in its own frame.

    Args:
        rotation: of the object.
        up: the mean of up in its own frame while it stands, which turns about that do not change.
        solid: its surface.
    """
    if not len(solid.stands):
        return rotation, None
    axis = solid.stands[int(np.argmax(solid.stands @ up))]
    if axis @ up < np.cos(_LEANS) * np.linalg.norm(up):
        return rotation, None
    return shortest_turn(rotation @ axis, _UP).as_matrix() @ rotation, axis


def _shares(rests: Sequence[Rest], frames: int, fps: float) -> list[np.ndarray]:
    """How much of each rest's correction holds in each frame: all of it there, fading out beside it."""
    time = np.arange(frames) / fps
    raw = []
    for rest in rests:
        off = np.maximum(np.maximum(rest.begin / fps - time, time - (rest.end - 1) / fps), 0.0)
        raw.append(smoothstep(1 - off / _FADE))
    total = np.maximum(np.sum(raw, axis=0), 1.0)
    inside = np.array([[rest.begin <= t < rest.end for t in range(frames)] for rest in rests])
    shares = np.where(inside.any(axis=0), inside, np.array(raw) / total)
    return list(shares)
