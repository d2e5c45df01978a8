"""A real recording as a demonstration: where up is, what the hand held, and how, at the twin's rate.

One camera recording of a hand and an object is off by centimetres where they hide each other, and more where an object
looks the same from all sides. Four facts mend it: gravity, an object that stands until it is lifted, a grasp that does
not slip, and fingers that touch without sinking in. The object's way, the reach and the posture stay the recording's.
"""

import dataclasses
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.convex_pieces import convex_pieces
from envs.demonstrations.firmness import firmest
from envs.demonstrations.holding import Holding, solve_holdings, spin_of
from envs.demonstrations.standing import Table, find_table, world_from_recording
from envs.signed_distance import hull_planes
from mjx_hand.capture.datasets.dexmv_object import RecordedObject, load_object, recording_files
from mjx_hand.capture.keypoints.bone_lengths import lengths, shape_of_lengths
from mjx_hand.capture.keypoints.layouts import hand_keypoints
from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.model import HandModel
from mjx_hand.motion.demonstration import Demonstration, ObjectDescription
from mjx_hand.motion.gaps import fill_turns
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.resample import interpolation_index, matrix_quaternions, quaternion_matrices, slerp
from mjx_hand.motion.smooth import smooth_rows
from mjx_hand.retarget.refine import recorded_places, refine_angles
from mjx_hand.retarget.sequence import retarget_sequence, rigid_hand_of
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand, chain, forward_kinematics, tip_positions

RECORDED = "recorded"  # what a demonstration that is of no grasp type calls its grasp
_SAME = np.deg2rad(25.0)  # an object seen turned more than this in a hand that holds it was not seen rightly
_ARRIVED, _LEAVING = 11, 2  # frames before the object is away between which the hand is at it
_ROUNDS = 5  # of a robust mean
# s before the lift: from when to when the recorded reach goes over into the holding. The correction is as large as
# capture's error at the lift; made late, it would go through the object.
_CLOSING, _HELD = 1.4, 0.4
_FOOT = 0.004  # m above its lowest corner
_RISEN = 0.01  # m above its place: the object leaves the table


def read_demonstration(
    folder: str | Path, *, mass: float, friction: float, pieces: int, rate: float, cutoff: float
) -> Demonstration:
    """The demonstration that a DexMV recording of a hand and an object shows.

    Args:
        folder: holds the recording's `.npz` and the object's `.stl`.
        mass, friction: of the object, which no camera sees (kg).
        pieces: convex pieces at most that the object's mesh becomes.
        rate: of the demonstration, frames a second.
        cutoff: of the low-pass filter on poses and angles (Hz).

    Raises:
        InputError: files are missing or damaged, or the object is never seen standing and then lifted.
    """
    recording, mesh = recording_files(folder)
    motion, thing = load_motion(recording), load_object(recording, mesh)
    frames = min(motion.num_frames, len(thing.position))
    if not motion.valid[:frames].all():
        raise InputError(f"{recording}: {int((~motion.valid[:frames]).sum())} frames have no hand; leave those out")
    thing = dataclasses.replace(thing, rotation=thing.rotation[:frames], position=thing.position[:frames])
    table = find_table(thing)
    model = load_hand(side=motion.side)
    shape, angles = _angles(motion, model)
    hand = build_rigid_hand(model, shape)
    description = _description(thing, mass, friction, pieces)
    corners = description.hulls.reshape(-1, 3)
    turn = world_from_recording(table)
    seen = _in_world(motion, angles, thing, turn, table, -corners[:, 2].min())
    held, seen = _mended(seen, table.lifted)
    now = _resampled(seen, _beginning(seen, hand, table.lifted), rate, cutoff)
    lowest = np.einsum("tj,cj->tc", now.rotation[:, 2], corners).min(axis=1) + now.position[:, 2]
    now.position[:, 2] += np.maximum(-lowest, 0.0)  # the filter rounds off how the object leaves the table

    carrying = now.hand_rotation[int(np.argmax(now.position[:, 2]))]
    holdings = solve_holdings(held, hand, hull_planes(description.hulls))
    holding = firmest(holdings, hand, description, carrying)
    times = now.times - table.lifted / motion.fps
    share = _minimum_jerk((times + _CLOSING) / (_CLOSING - _HELD))
    # An object that looks the same from all sides was turned about its axis otherwise than it seemed, and not the hand.
    spin = Rotation.from_rotvec([0.0, 0.0, spin_of(held.rotation.T @ holding.rotation)]).as_matrix()
    object_rotation = now.rotation @ spin
    rotation = object_rotation @ holding.rotation.T
    position = now.position - np.einsum("tij,j->ti", rotation, holding.position)
    angles = now.angles + share[:, None] * (holding.angles - now.angles)
    source = f"{motion.source} with {mesh.name}"
    return Demonstration(
        motion=JointMotion(
            fps=rate,
            angles=np.clip(angles, hand.hinge_lower, hand.hinge_upper),
            wrist_position=now.hand_position + share[:, None] * (position - now.hand_position),
            wrist_quaternion=matrix_quaternions(slerp(now.hand_rotation, rotation, share)),
            valid=np.ones(len(now.times), bool),
            side=motion.side,
            source=source,
        ),
        object_pose=np.concatenate([now.position, matrix_quaternions(object_rotation)], axis=1),
        object=description,
        support=np.zeros((0, 3)),
        support_position=np.zeros((0, 3)),
        shape=shape,
        grasp=RECORDED,
        source=source,
    )


@dataclasses.dataclass(frozen=True)
class _Seen:
    """Hand and object in a world with z up and the table at z = 0; metres, radians."""

    times: Float[np.ndarray, "t"]
    angles: Float[np.ndarray, "t 20"]
    hand_rotation: Float[np.ndarray, "t 3 3"]
    hand_position: Float[np.ndarray, "t 3"]
    rotation: Float[np.ndarray, "t 3 3"]
    position: Float[np.ndarray, "t 3"]


def _angles(motion: Motion, model: HandModel) -> tuple[Float[np.ndarray, "s"], Float[np.ndarray, "t 20"]]:
    """The shape whose bones are nearest to the subject's own, and its hinge angles: finger tips are where they were."""
    subject = rigid_hand_of(motion, model)
    rest = chain(jnp.broadcast_to(jnp.eye(3), (15, 3, 3)), jnp.asarray(subject.link_offset))
    shape = shape_of_lengths(model, lengths(np.asarray(hand_keypoints(rest[1], tip_positions(*rest, subject)))))
    hand = build_rigid_hand(model, shape)
    angles = retarget_sequence(motion, hand, limits=True).angles
    return shape, np.asarray(refine_angles(angles, recorded_places(motion.rotations, subject), hand), float)


def _description(thing: RecordedObject, mass: float, friction: float, pieces: int) -> ObjectDescription:
    hulls = convex_pieces(thing.vertices, thing.faces, concavity=0.03, most=pieces)
    low = hulls[..., 2] < hulls[..., 2].min() + _FOOT
    hulls[low, 2] = hulls[..., 2].min()  # what stands has a flat foot, and few corners make it none
    return ObjectDescription(
        kind="mesh", size=np.abs(hulls).max(axis=(0, 1)), mass=mass, friction=friction, hulls=hulls
    )


def _in_world(
    motion: Motion,
    angles: Float[np.ndarray, "t 20"],
    thing: RecordedObject,
    turn: Float[np.ndarray, "3 3"],
    table: Table,
    height: float,
) -> _Seen:
    """What was recorded, z up, the object standing above the origin with its own at `height`."""
    frames = len(thing.position)
    home = np.median(thing.position[: table.standing], axis=0)
    shift = turn @ home - [0.0, 0.0, height]
    return _Seen(
        times=np.arange(frames) / motion.fps,
        angles=angles[:frames],
        hand_rotation=turn @ quaternion_matrices(motion.wrist_quaternion[:frames]),
        hand_position=motion.wrist_position[:frames] @ turn.T - shift,
        rotation=turn @ thing.rotation,
        position=thing.position @ turn.T - shift,
    )


def _mended(seen: _Seen, lifted: int) -> tuple[Holding, _Seen]:
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


def _half_way(mean: Rotation, seen: _Seen, lifted: int) -> Rotation:
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


def _beginning(seen: _Seen, hand: RigidHand, lifted: int) -> float:
    """When the hand comes above the table for good (s), before the object is lifted."""
    joints = np.asarray(forward_kinematics(seen.angles[:lifted], hand)[1], float)
    height = np.einsum("tj,tlj->tl", seen.hand_rotation[:lifted, 2], joints) + seen.hand_position[:lifted, 2, None]
    below = np.flatnonzero(height.min(axis=1) < 0)
    return float(seen.times[below[-1] + 1 if below.size and below[-1] + 1 < lifted else 0])


def _resampled(seen: _Seen, begin: float, rate: float, cutoff: float) -> _Seen:
    """From `begin` on, at another rate, filtered."""
    times = np.arange(begin, seen.times[-1] + 1e-6, 1 / rate)
    before, after, fraction = interpolation_index(seen.times, times)

    def line(rows: np.ndarray) -> np.ndarray:
        between = (1 - fraction[:, None]) * rows[before] + fraction[:, None] * rows[after]
        return smooth_rows(between, rate, cutoff)

    def arc(rotation: np.ndarray) -> np.ndarray:
        rows = matrix_quaternions(slerp(rotation[before], rotation[after], fraction))
        rows = smooth_rows(rows, rate, cutoff)
        return quaternion_matrices(rows / np.linalg.norm(rows, axis=1, keepdims=True))

    return _Seen(
        times=times,
        angles=line(seen.angles),
        hand_rotation=arc(seen.hand_rotation),
        hand_position=line(seen.hand_position),
        rotation=arc(seen.rotation),
        position=line(seen.position),
    )


def _minimum_jerk(s: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t"]:
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)
