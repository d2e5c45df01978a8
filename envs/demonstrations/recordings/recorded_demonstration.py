"""A recording with an object as a demonstration: every step general, each with its figures.

The hand and the object that it moves, up, and the frames that it can repeat (`observation`); the object's way settled
on what it stands on; the hand on the twin's hinges, its posture corrected so that what touches touches and nothing
sinks in; a mass. Whether the twin carries it is tried afterwards, for all recordings at once
(`recordings.demonstration_set`).
"""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import GraspPose, last_phalanges
from envs.demonstrations.from_recording.touching import (
    corrected,
    gaps_over_time,
    touching_shares,
)
from envs.demonstrations.observation.scene_in_world import Handled, handled_object
from envs.demonstrations.observation.settled_path import support_boxes
from envs.demonstrations.observation.solids import pieces_of, with_foot
from envs.demonstrations.recordings.observed_grasp import ObservedGrasp, observed_grasp
from envs.demonstrations.recordings.recording_settings import RecordingSettings
from envs.grip_force import RECORDED
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.motion.resample import matrix_quaternions, quaternion_matrices
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.retarget.hands import KinematicHands

_DENSITY = 500.0  # kg/m³ where no mass is known: between an empty and a full container


@dataclasses.dataclass(frozen=True)
class Figures:
    """What became of a recording.

    Attributes:
        name: of the recording.
        side, object: the hand, and what it moves.
        first, last, frames: of the act, in the recording, and how many frames that has.
        rate: of the recording, 1/s.
        up: how up was known.
        supports: heights of what the object rests on above the lowest (m).
        mass, how_heavy: kg, and how it was known.
        pieces: convex pieces.
        touching: fingers that touch while it is carried.
        gap_before, gap: mean distance of touching tips from the surface while it is carried, as recorded and corrected
            (m).
        depth_before, depth: how deep the hand is in the object at most (m).
        hand_moved, hand_turned: mean change of the wrist (m, rad), and of the hinges:
        angles_moved: rad.
        object_moved, object_turned: largest change of the object's place (m) and orientation (rad) where it rests.
        way_moved: mean change of the object's place while it is carried (m).
        bridged: frames whose orientation of the object was not believed.
        left_out: reasons to frames of the recording that are not in the demonstration.
        carried: share of its frames up to which the twin carries it with nothing learned, and the frame.
        lost: the frame in which it is lost then; null where it is not.
        road: how the twin came to carry it.
        mirrored: whether the demonstration is the recording's mirror image, for a set that most of is the other hand's.
    """

    name: str
    side: str
    object: str
    first: int
    last: int
    frames: int
    rate: float
    up: str
    supports: Sequence[float]
    mass: float
    how_heavy: str
    pieces: int
    touching: Sequence[str]
    gap_before: float
    gap: float
    depth_before: float
    depth: float
    hand_moved: float
    hand_turned: float
    angles_moved: float
    object_moved: float
    object_turned: float
    way_moved: float
    bridged: int
    left_out: Mapping[str, Sequence[tuple[int, int]]]
    carried: float = 0.0
    lost: int | None = None
    road: str = ""
    mirrored: bool = False


@dataclasses.dataclass(frozen=True)
class Recorded:
    """A recording's demonstration, its figures, and what a search for another grasp would begin with."""

    demonstration: Demonstration
    figures: Figures
    handled: Handled
    observed: ObservedGrasp


def read_recording(path: Path, settings: RecordingSettings, hands: KinematicHands) -> Recorded:
    """The demonstration that a recording shows, its posture corrected.

    Raises:
        InputError: files are missing or damaged, or as `handled_object`.
    """
    scene = load_scene(path)
    handled = handled_object(scene, str(path), hands, side=settings.side, name=settings.object, up=settings.up)
    observed = observed_grasp(handled, settings)
    description, how_heavy = _description(handled, observed, settings, str(path))
    demonstration, figures = _demonstration(handled, observed, description, settings, path)
    return Recorded(demonstration, dataclasses.replace(figures, how_heavy=how_heavy), handled, observed)


def _demonstration(
    handled: Handled,
    observed: ObservedGrasp,
    description: ObjectDescription,
    settings: RecordingSettings,
    path: Path,
) -> tuple[Demonstration, Figures]:
    sequence, hand = observed.sequence, observed.hand
    into = np.swapaxes(sequence.hand_rotation, 1, 2)
    lies = GraspPose(
        angles=np.clip(sequence.angles, hand.hinge_lower, hand.hinge_upper),
        rotation=into @ sequence.rotation,
        position=np.einsum("tij,tj->ti", into, sequence.position - sequence.hand_position),
    )
    planes = hull_planes(description.hulls)
    before = gaps_over_time(lies, hand, planes)
    shares = touching_shares(before, hand, observed.carried, settings.rate)
    held = corrected(lies, shares, hand, planes, settings.rate, settings.cutoff)
    after = gaps_over_time(held, hand, planes)
    motion, wrist = _motion(held, sequence.rotation, sequence.position, handled.motion.side, "", sequence.times)
    source = f"{path.name}: {handled.motion.side} hand with {handled.name}"
    halves, centres = support_boxes(observed.settled.rests, handled.solid)
    demonstration = Demonstration(
        motion=dataclasses.replace(motion, source=source),
        object_pose=np.concatenate([sequence.position, matrix_quaternions(sequence.rotation)], axis=1),
        object=description,
        support=halves,
        support_position=centres,
        shape=observed.shape,
        grasp=RECORDED,
        source=source,
    )
    tips, touched = last_phalanges(hand), (shares > 0.5) & observed.carried[:, None]
    turned = Rotation.from_matrix(np.swapaxes(sequence.hand_rotation, 1, 2) @ wrist).magnitude()
    act, settled = handled.act, observed.settled
    rests = np.zeros(len(settled.moved), bool)
    for rest in settled.rests:
        rests[rest.begin : rest.end] = True
    figures = Figures(
        name=path.name if path.is_dir() else path.stem,
        side=handled.motion.side,
        object=handled.name,
        first=act.begin,
        last=act.end - 1,
        frames=handled.frames,
        rate=handled.motion.fps,
        up=handled.up,
        supports=sorted({round(rest.level, 4) for rest in settled.rests}),
        mass=description.mass,
        how_heavy="",
        pieces=len(description.hulls),
        touching=[finger for k, finger in enumerate(FINGERS) if touched[:, k].any()],
        gap_before=_mean(np.abs(before[:, tips])[touched]),
        gap=_mean(np.abs(after[:, tips])[touched]),
        depth_before=max(-float(before.min()), 0.0),
        depth=max(-float(after.min()), 0.0),
        hand_moved=_mean(np.linalg.norm(motion.wrist_position - observed.recorded_hand, axis=1)),
        hand_turned=_mean(turned),
        angles_moved=_mean(np.abs(held.angles - lies.angles)),
        object_moved=float(np.linalg.norm(settled.moved[rests], axis=1).max(initial=0.0)),
        object_turned=float(Rotation.from_matrix(settled.turned).magnitude().max()),
        way_moved=_mean(np.linalg.norm(sequence.position - observed.recorded_object, axis=1)[observed.carried]),
        bridged=settled.bridged,
        left_out=act.left_out,
    )
    return demonstration, figures


def _motion(
    held: GraspPose, rotation: np.ndarray, position: np.ndarray, side: str, source: str, times: np.ndarray
) -> tuple[JointMotion, np.ndarray]:
    wrist = rotation @ np.swapaxes(held.rotation, 1, 2)
    quaternion = matrix_quaternions(wrist)
    return (
        JointMotion(
            fps=float(round(1 / (times[1] - times[0]), 6)),
            angles=held.angles,
            wrist_position=position - np.einsum("tij,tj->ti", wrist, held.position),
            wrist_quaternion=quaternion,
            valid=np.ones(len(times), bool),
            side=side,
            source=source,
        ),
        quaternion_matrices(quaternion),
    )


def _description(
    handled: Handled, observed: ObservedGrasp, settings: RecordingSettings, where: str
) -> tuple[ObjectDescription, str]:
    solid = handled.solid
    hulls = pieces_of(solid, settings.pieces)
    for rest in observed.settled.rests:
        if rest.stand is not None:
            hulls = with_foot(hulls, solid, rest.stand)
    if settings.mass is not None:
        mass, how = settings.mass, "given"
    elif settings.density is not None:
        if not solid.closed:
            raise InputError(
                f"{where}: the mesh of {handled.name!r} is not closed and has no volume to take the density of; "
                "give data.recording.mass"
            )
        mass, how = settings.density * solid.volume, f"{settings.density:g} kg/m³ of {1e3 * solid.volume:.2f} l"
    elif settings.masses is not None:
        mass, how = float(np.mean(settings.masses)), f"middle of {settings.masses[0]:g} to {settings.masses[1]:g} kg"
    else:
        mass = _DENSITY * solid.volume
        what = "" if solid.closed else " of its convex hull, as the mesh is not closed"
        how = f"not given: {_DENSITY:g} kg/m³ of {1e3 * solid.volume:.2f} l{what}"
    size = np.abs(hulls).max(axis=(0, 1))
    return ObjectDescription(kind="mesh", size=size, mass=mass, friction=settings.friction, hulls=hulls), how


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if values.size else 0.0
