"""What a recording shows of a hand and an object, in a world with z up, without what cannot have been."""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import GraspPose
from envs.demonstrations.from_recording.support_plane import SupportPlane
from mjx_hand.motion.gaps import fill_turns
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.resample import interpolation_index, matrix_quaternions, quaternion_matrices, slerp
from mjx_hand.motion.scene import RecordedObject
from mjx_hand.motion.smooth import smooth_rows
from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics

_SAME = np.deg2rad(25.0)  # an object seen turned more than this in a hand that holds it was not seen rightly
_ARRIVED, _LEAVING = 11, 2  # frames before the object is away between which the hand is at it
_ROUNDS = 5  # of a robust mean
_RISEN = 0.01  # m above its place: the object leaves the table


@dataclasses.dataclass(frozen=True)
class ObservedSequence:
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
    recorded: RecordedObject,
    turn: Float[np.ndarray, "3 3"],
    table: SupportPlane,
    height: float,
) -> ObservedSequence:
    """What was recorded, z up, the object standing above the origin with its own at `height`."""
    frames = len(recorded.position)
    home = np.median(recorded.position[: table.standing], axis=0)
    shift = turn @ home - [0.0, 0.0, height]
    return ObservedSequence(
        times=np.arange(frames) / motion.fps,
        angles=angles[:frames],
        hand_rotation=turn @ quaternion_matrices(motion.wrist_quaternion[:frames]),
        hand_position=motion.wrist_position[:frames] @ turn.T - shift,
        rotation=turn @ recorded.rotation,
        position=recorded.position @ turn.T - shift,
    )


def reconstruct(observed: ObservedSequence, lifted: int) -> tuple[GraspPose, ObservedSequence]:
    """How the object lies in the hand that carries it, and its poses without what cannot have been.

    It stands still until it is lifted; where it is carried, orientations far from how it lies in the hand are bridged.
    """
    into_hand = np.swapaxes(observed.hand_rotation, 1, 2)
    turned = into_hand @ observed.rotation
    placed = np.einsum("tij,tj->ti", into_hand, observed.position - observed.hand_position)
    apart = Rotation.from_matrix(turned[lifted:])
    off = np.stack([(one.inv() * apart).magnitude() for one in apart])
    mean = apart[int(np.argmin(np.minimum(off, _SAME).sum(axis=1)))]  # the one that most are near to
    for _ in range(_ROUNDS):
        mean = apart[(mean.inv() * apart).magnitude() < _SAME].mean()
    credible = np.concatenate([np.zeros(lifted, bool), (mean.inv() * apart).magnitude() < _SAME])
    held = GraspPose(
        angles=np.median(observed.angles[credible], axis=0),
        rotation=(_half_way(mean, observed, lifted) * mean).as_matrix(),
        position=np.median(placed[credible], axis=0),
    )
    home = np.array([0.0, 0.0, np.median(observed.position[: lifted // 2, 2])])
    stands = np.arange(len(observed.times)) <= np.flatnonzero(observed.position[:lifted, 2] < home[2] + _RISEN)[-1]
    rotation = observed.rotation.copy()
    rotation[stands] = _upright(rotation[np.argmax(credible)])
    turns = fill_turns(matrix_quaternions(rotation), stands | credible)
    position = np.where(stands[:, None], home, observed.position)
    return held, dataclasses.replace(observed, rotation=quaternion_matrices(turns), position=position)


def start_time(observed: ObservedSequence, hand: RigidHand, lifted: int) -> float:
    """When the hand comes above the table for good (s), before the object is lifted."""
    joints = np.asarray(forward_kinematics(observed.angles[:lifted], hand)[1], float)
    height = (
        np.einsum("tj,tlj->tl", observed.hand_rotation[:lifted, 2], joints) + observed.hand_position[:lifted, 2, None]
    )
    below = np.flatnonzero(height.min(axis=1) < 0)
    return float(observed.times[below[-1] + 1 if below.size and below[-1] + 1 < lifted else 0])


def resampled(observed: ObservedSequence, begin: float, rate: float, cutoff: float) -> ObservedSequence:
    """From `begin` (s) on, at another rate (frames/s), filtered (Hz)."""
    times = np.arange(begin, observed.times[-1] + 1e-6, 1 / rate)
    before, after, fraction = interpolation_index(observed.times, times)

    def line(rows: np.ndarray) -> np.ndarray:
        between = (1 - fraction[:, None]) * rows[before] + fraction[:, None] * rows[after]
        return smooth_rows(between, rate, cutoff)

    def arc(rotation: np.ndarray) -> np.ndarray:
        rows = matrix_quaternions(slerp(rotation[before], rotation[after], fraction))
        rows = smooth_rows(rows, rate, cutoff)
        return quaternion_matrices(rows / np.linalg.norm(rows, axis=1, keepdims=True))

    return ObservedSequence(
        times=times,
        angles=line(observed.angles),
        hand_rotation=arc(observed.hand_rotation),
        hand_position=line(observed.hand_position),
        rotation=arc(observed.rotation),
        position=line(observed.position),
    )


def _half_way(mean: Rotation, observed: ObservedSequence, lifted: int) -> Rotation:
    """From how the object's axis lies in the hand that carries it half way to how it does when the hand arrives.

    Both are measured, as badly, and in a firm grasp they are one.
    """
    carried = mean.apply([0.0, 0.0, 1.0])
    arriving = observed.hand_rotation[lifted - _ARRIVED : lifted - _LEAVING, 2].mean(axis=0)  # world's z in the hand
    arriving /= np.linalg.norm(arriving)
    axis = np.cross(carried, arriving)
    angle = np.arctan2(np.linalg.norm(axis), carried @ arriving)
    return Rotation.from_rotvec(axis / max(np.linalg.norm(axis), 1e-9) * angle / 2)


def _upright(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """The nearest rotation whose z axis is up."""
    x = rotation[:, 0] * [1.0, 1.0, 0.0]
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross([0.0, 0.0, 1.0], x), [0.0, 0.0, 1.0]], axis=1)
