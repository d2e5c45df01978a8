"""What a recording shows of a hand and an object, in a world with z up, without what cannot have been."""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import Holding
from envs.demonstrations.from_recording.support_plane import Table
from mjx_hand.capture.datasets.dexmv_object import RecordedObject
from mjx_hand.motion.gaps import fill_turns
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.resample import interpolation_index, matrix_quaternions, quaternion_matrices, slerp
from mjx_hand.motion.smooth import smooth_rows
from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics

_SAME = np.deg2rad(25.0)  # an object seen turned more than this in a hand that holds it was not seen rightly
_ARRIVED, _LEAVING = 11, 2  # frames before the object is away between which the hand is at it
_ROUNDS = 5  # of a robust mean
_RISEN = 0.01  # m above its place: the object leaves the table


@dataclasses.dataclass(frozen=True)
class Seen:
    """Hand and object, z up and the table at z = 0; metres, radians, seconds."""

    times: Float[np.ndarray, "t"]
    angles: Float[np.ndarray, "t 20"]
    hand_rotation: Float[np.ndarray, "t 3 3"]
    hand_position: Float[np.ndarray, "t 3"]
    rotation: Float[np.ndarray, "t 3 3"]
    position: Float[np.ndarray, "t 3"]


def in_world(
    motion: Motion,
    angles: Float[np.ndarray, "t 20"],
    thing: RecordedObject,
    turn: Float[np.ndarray, "3 3"],
    table: Table,
    height: float,
) -> Seen:
    """What was recorded, z up, the object standing above the origin with its own at `height`."""
    frames = len(thing.position)
    home = np.median(thing.position[: table.standing], axis=0)
    shift = turn @ home - [0.0, 0.0, height]
    return Seen(
        times=np.arange(frames) / motion.fps,
        angles=angles[:frames],
        hand_rotation=turn @ quaternion_matrices(motion.wrist_quaternion[:frames]),
        hand_position=motion.wrist_position[:frames] @ turn.T - shift,
        rotation=turn @ thing.rotation,
        position=thing.position @ turn.T - shift,
    )


def mended(seen: Seen, lifted: int) -> tuple[Holding, Seen]:
    """How the object lies in the hand that carries it, and its poses without what cannot have been.

    It stands still until it is lifted; where it is carried, orientations far from how it lies in the hand are bridged.
    """
    into_hand = np.swapaxes(seen.hand_rotation, 1, 2)
    turned = into_hand @ seen.rotation
    placed = np.einsum("tij,tj->ti", into_hand, seen.position - seen.hand_position)
    apart = Rotation.from_matrix(turned[lifted:])
    off = np.stack([(one.inv() * apart).magnitude() for one in apart])
    mean = apart[int(np.argmin(np.minimum(off, _SAME).sum(axis=1)))]  # the one that most are near to
    for _ in range(_ROUNDS):
        mean = apart[(mean.inv() * apart).magnitude() < _SAME].mean()
    credible = np.concatenate([np.zeros(lifted, bool), (mean.inv() * apart).magnitude() < _SAME])
    held = Holding(
        angles=np.median(seen.angles[credible], axis=0),
        rotation=(_half_way(mean, seen, lifted) * mean).as_matrix(),
        position=np.median(placed[credible], axis=0),
    )
    home = np.array([0.0, 0.0, np.median(seen.position[: lifted // 2, 2])])
    stands = np.arange(len(seen.times)) <= np.flatnonzero(seen.position[:lifted, 2] < home[2] + _RISEN)[-1]
    rotation = seen.rotation.copy()
    rotation[stands] = _upright(rotation[np.argmax(credible)])
    turns = fill_turns(matrix_quaternions(rotation), stands | credible)
    position = np.where(stands[:, None], home, seen.position)
    return held, dataclasses.replace(seen, rotation=quaternion_matrices(turns), position=position)


def beginning(seen: Seen, hand: RigidHand, lifted: int) -> float:
    """When the hand comes above the table for good (s), before the object is lifted."""
    joints = np.asarray(forward_kinematics(seen.angles[:lifted], hand)[1], float)
    height = np.einsum("tj,tlj->tl", seen.hand_rotation[:lifted, 2], joints) + seen.hand_position[:lifted, 2, None]
    below = np.flatnonzero(height.min(axis=1) < 0)
    return float(seen.times[below[-1] + 1 if below.size and below[-1] + 1 < lifted else 0])


def resampled(seen: Seen, begin: float, rate: float, cutoff: float) -> Seen:
    """From `begin` (s) on, at another rate (frames/s), filtered (Hz)."""
    times = np.arange(begin, seen.times[-1] + 1e-6, 1 / rate)
    before, after, fraction = interpolation_index(seen.times, times)

    def line(rows: np.ndarray) -> np.ndarray:
        between = (1 - fraction[:, None]) * rows[before] + fraction[:, None] * rows[after]
        return smooth_rows(between, rate, cutoff)

    def arc(rotation: np.ndarray) -> np.ndarray:
        rows = matrix_quaternions(slerp(rotation[before], rotation[after], fraction))
        rows = smooth_rows(rows, rate, cutoff)
        return quaternion_matrices(rows / np.linalg.norm(rows, axis=1, keepdims=True))

    return Seen(
        times=times,
        angles=line(seen.angles),
        hand_rotation=arc(seen.hand_rotation),
        hand_position=line(seen.hand_position),
        rotation=arc(seen.rotation),
        position=line(seen.position),
    )


def _half_way(mean: Rotation, seen: Seen, lifted: int) -> Rotation:
    """From how the object's axis lies in the hand that carries it half way to how it does when the hand arrives.

    Both are measured, as badly, and in a firm grasp they are one.
    """
    carried = mean.apply([0.0, 0.0, 1.0])
    arriving = seen.hand_rotation[lifted - _ARRIVED : lifted - _LEAVING, 2].mean(axis=0)  # world's z in the hand
    arriving /= np.linalg.norm(arriving)
    axis = np.cross(carried, arriving)
    angle = np.arctan2(np.linalg.norm(axis), carried @ arriving)
    return Rotation.from_rotvec(axis / max(np.linalg.norm(axis), 1e-9) * angle / 2)


def _upright(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """The nearest rotation whose z axis is up."""
    x = rotation[:, 0] * [1.0, 1.0, 0.0]
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross([0.0, 0.0, 1.0], x), [0.0, 0.0, 1.0]], axis=1)
