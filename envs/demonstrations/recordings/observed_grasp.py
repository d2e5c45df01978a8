"""What a hand does with an object, at the twin's rate: its angles and wrist, the object's way, who touches what."""

import dataclasses

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.observed import ObservedSequence, resampled
from envs.demonstrations.observation.handling import CARRIED
from envs.demonstrations.observation.scene_in_world import Handled
from envs.demonstrations.observation.settled_path import SettledPath, settled_path
from envs.demonstrations.recordings.recording_settings import RecordingSettings
from mjx_hand.capture.keypoints.bone_lengths import lengths, shape_of_lengths
from mjx_hand.capture.keypoints.layouts import hand_keypoints
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.model import HandModel
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.pytree import replace
from mjx_hand.retarget.refine import recorded_places, refine_angles
from mjx_hand.retarget.sequence import retarget_sequence, rigid_hand_of
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand, chain, tip_positions

_WITH_IT, _WITHOUT = 0.05, 0.2  # m from the object: within the hand is moved as the object is, beyond not at all


@dataclasses.dataclass(frozen=True)
class ObservedGrasp:
    """A hand and an object, z up, the lowest support at z = 0, at the twin's rate.

    Attributes:
        sequence: what was recorded, filtered; the object's way is settled.
        carried: frames in which the hand has it.
        settled: the way at the recording's rate.
        shape, hand: of the person.
        recorded_hand, recorded_object: where the recording has the wrist and the object (m), in the same axes.
    """

    sequence: ObservedSequence
    carried: Bool[np.ndarray, "t"]
    settled: SettledPath
    shape: Float[np.ndarray, "s"]
    hand: RigidHand
    recorded_hand: Float[np.ndarray, "t 3"]
    recorded_object: Float[np.ndarray, "t 3"]


def observed_grasp(handled: Handled, settings: RecordingSettings) -> ObservedGrasp:
    """The act of a recording, at the twin's rate: the object's way settled, the hand on the twin's hinges, filtered."""
    motion, act = handled.motion, handled.act
    span = slice(act.begin, act.end)
    model = load_hand(side=motion.side)
    shape, hand, angles = _on_hinges(_frames(motion, span), model)
    rotation = handled.world @ quaternion_matrices(fill_turns(motion.wrist_quaternion, motion.valid))[span]
    position = (fill_lines(motion.wrist_position, motion.valid) @ handled.world.T)[span]
    path = handled.path
    path = dataclasses.replace(
        path,
        position=path.position[span],
        rotation=path.rotation[span],
        seen=path.seen[span],
        still=path.still[span],
    )
    settled = settled_path(path, act.labels, rotation, handled.solid, motion.fps)
    near = np.clip((_WITHOUT - handled.distance[span]) / (_WITHOUT - _WITH_IT), 0, 1)
    arc = Rotation.from_matrix(settled.turned).as_rotvec() * near[:, None]
    turn = Rotation.from_rotvec(arc).as_matrix()
    moved = near[:, None] * settled.moved - settled.origin
    hand_position = path.position + np.einsum("tij,tj->ti", turn, position - path.position) + moved
    raw = ObservedSequence(
        times=np.arange(act.end - act.begin) / motion.fps,
        angles=angles,
        hand_rotation=turn @ rotation,
        hand_position=hand_position,
        rotation=settled.rotation,
        position=settled.position,
    )
    sequence = resampled(raw, 0.0, settings.rate, settings.cutoff)
    recorded = dataclasses.replace(
        raw, hand_position=position - settled.origin, position=path.position - settled.origin
    )
    recorded = resampled(recorded, 0.0, settings.rate, settings.cutoff)
    lowest = sequence.position[:, 2] + handled.solid.lowest(sequence.rotation, np.eye(3)[2])
    sequence.position[:, 2] += np.maximum(-lowest, 0.0)  # the filter rounds off how an object leaves the table
    before = np.clip((sequence.times * motion.fps).round().astype(int), 0, len(act.labels) - 1)
    carried = act.labels[before] == CARRIED
    return ObservedGrasp(sequence, carried, settled, shape, hand, recorded.hand_position, recorded.position)


def _on_hinges(motion: Motion, model: HandModel) -> tuple[np.ndarray, RigidHand, np.ndarray]:
    """The shape whose bones are nearest to the subject's own, its hand, and its angles: tips are where they were."""
    subject = rigid_hand_of(motion, model)
    shape = motion.shape
    if motion.link_offset is not None:
        rest = chain(jnp.broadcast_to(jnp.eye(3), (15, 3, 3)), jnp.asarray(subject.link_offset))
        known = lengths(np.asarray(hand_keypoints(rest[1], tip_positions(*rest, subject))))
        shape = shape_of_lengths(model, known)
    hand = build_rigid_hand(model, shape)
    joints = retarget_sequence(motion, hand, limits=True)
    places = recorded_places(_padded(motion.rotations), subject)
    angles = np.asarray(refine_angles(_padded(joints.angles), places, hand), float)[: motion.num_frames]
    return np.asarray(shape, float), hand, fill_lines(angles, motion.valid)


def _frames(motion: Motion, span: slice) -> Motion:
    by_frame = ("rotations", "wrist_position", "wrist_quaternion", "valid")
    return replace(motion, **{field: getattr(motion, field)[span] for field in by_frame})


def _padded(rows: np.ndarray) -> np.ndarray:
    """Up to a power of two, by the last one: recordings of any length share few compilations."""
    missing = max(256, 1 << (len(rows) - 1).bit_length()) - len(rows)
    return np.concatenate([rows, np.repeat(rows[-1:], missing, axis=0)])
