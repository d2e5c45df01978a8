"""Another grasp near the recorded one, where the recorded one carries nothing: the search in the engine."""

import dataclasses
from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import GraspPose, last_phalanges, solve_grasp_poses
from envs.demonstrations.from_recording.grasp_search import search_grasp
from envs.demonstrations.from_recording.grasp_trajectory import Act, grasp_trajectory
from envs.demonstrations.from_recording.observed import ObservedSequence
from envs.demonstrations.from_recording.shared_way import shared_way
from envs.demonstrations.from_recording.touching import gaps_over_time
from envs.demonstrations.observation.settled_path import held_rotation, shortest_turn
from envs.demonstrations.recordings.recorded_demonstration import Figures, Recorded
from envs.demonstrations.recordings.recording_settings import RecordingSettings
from envs.grip_force import grip_force_of
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.gaps import spans
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.motion.resample import matrix_quaternions
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.pytree import replace

_FORCE = 4.5  # of `grip_force_of`: what the grasp that is searched for must hold with
_ARRIVING = (0.45, 0.1)  # s before the lift: where the hand is at the object and has not moved it
_PUT_DOWN = "the grasp that was searched for ends where the object is first put down"
_EARLIEST = 0.7  # s before the lift that the approach takes


def better_grasp(
    recorded: Recorded, figures: Figures, settings: RecordingSettings, report: Callable[[str, float], None]
) -> tuple[Demonstration, Figures]:
    """The demonstration with one grasp from the lift on, searched near the recorded one, that carries the object.

    What is put down is held to there: the demonstration ends with the first carrying.

    Raises:
        InputError: the lift comes too early for an approach, or no grasp near the recorded one carries it.
    """
    sequence, carried = recorded.observed.sequence, recorded.observed.carried
    begin, end = spans(carried)[0]
    lifted = float(sequence.times[begin])
    if lifted < _EARLIEST:
        raise InputError(f"an approach of {lifted:.1f} s is too short to search for another grasp ({_EARLIEST:g} s)")
    frame = _upright_frame(recorded)
    held = ObservedSequence(**{f.name: getattr(sequence, f.name)[:end] for f in dataclasses.fields(sequence)})
    held = dataclasses.replace(held, rotation=held.rotation @ frame.T)
    described = recorded.demonstration.object
    turned = replace(described, hulls=described.hulls @ frame.T)
    spun = recorded.handled.path.noisy
    corners = turned.hulls.reshape(-1, 3)
    met, wrist = shared_way(held, begin, corners, rests=end < len(carried), spun=spun)
    act = Act(
        observed=met,
        lifted=lifted,
        held=_held(met, begin, wrist),
        hand=recorded.observed.hand,
        object=turned,
        spun=spun,
        support=recorded.demonstration.support,
        support_position=recorded.demonstration.support_position,
    )
    candidates = solve_grasp_poses(act.held, act.hand, act.planes, spun=spun)
    force = settings.force or grip_force_of(described.mass, described.friction, _FORCE)
    trajectory = grasp_trajectory(act, search_grasp(act, candidates, force, report)[None])
    rotation = trajectory.rotation[0] @ frame
    motion = recorded.demonstration.motion
    made = replace(
        recorded.demonstration,
        motion=JointMotion(
            fps=motion.fps,
            angles=trajectory.angles[0],
            wrist_position=trajectory.wrist_position[0],
            wrist_quaternion=matrix_quaternions(trajectory.wrist_rotation[0]),
            valid=np.ones(end, bool),
            side=motion.side,
            source=motion.source,
        ),
        object_pose=np.concatenate([trajectory.position, matrix_quaternions(rotation)], axis=1),
    )
    return made, _measured(recorded, figures, made, trajectory.wrist_rotation[0], rotation, carried[:end])


def _measured(
    recorded: Recorded,
    figures: Figures,
    made: Demonstration,
    wrist: Float[np.ndarray, "t 3 3"],
    rotation: Float[np.ndarray, "t 3 3"],
    carried: np.ndarray,
) -> Figures:
    observed, end = recorded.observed, made.num_frames
    into = np.swapaxes(wrist, 1, 2)
    offset = made.object_pose[:, :3] - made.motion.wrist_position
    lies = GraspPose(made.motion.angles, into @ rotation, np.einsum("tij,tj->ti", into, offset))
    gaps = gaps_over_time(lies, observed.hand, hull_planes(made.object.hulls))
    moved = np.linalg.norm(made.motion.wrist_position - observed.recorded_hand[:end], axis=1)
    way = made.object_pose[:, :3] - observed.recorded_object[:end]
    turned = Rotation.from_matrix(np.swapaxes(observed.sequence.hand_rotation[:end], 1, 2) @ wrist).magnitude()
    tips = last_phalanges(observed.hand)
    behind = figures.first + round(end * figures.rate / made.motion.fps)  # of the recording, after the first carrying
    left_out = {_PUT_DOWN: [(behind, figures.last)]} if behind <= figures.last else {}
    return dataclasses.replace(
        figures,
        gap=float(np.abs(gaps[carried][:, tips]).mean()),
        depth=max(-float(gaps.min()), 0.0),
        hand_moved=float(moved.mean()),
        hand_turned=float(turned.mean()),
        way_moved=float(np.linalg.norm(way, axis=1)[carried].mean()),
        angles_moved=float(np.abs(made.motion.angles - observed.sequence.angles[:end]).mean()),
        carried=1.0,  # in the search, which keeps no other
        lost=None,
        left_out={**figures.left_out, **left_out},
    )


def _upright_frame(recorded: Recorded) -> Float[np.ndarray, "3 3"]:
    """Rows are axes of the object's frame in its own: z is up where it first rests."""
    rest = recorded.observed.settled.rests[0]
    up = rest.rotation[2] if rest.stand is None else rest.stand
    x = np.eye(3)[int(np.argmin(np.abs(up)))]
    x = x - up * (x @ up)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def _held(observed: ObservedSequence, lifted: int, wrist: Float[np.ndarray, "3"]) -> GraspPose:
    """How the object lies in the hand that carries it: the robust mean, its axis half way to how the hand arrived.

    Both are measured, as badly, and in a firm grasp they are one. The wrist is where it is beside the object.
    """
    lies = Rotation.from_matrix((np.swapaxes(observed.hand_rotation, 1, 2) @ observed.rotation)[lifted:])
    mean, near = held_rotation(lies)
    times = observed.times[lifted] - observed.times
    arriving = observed.hand_rotation[(times < _ARRIVING[0]) & (times > _ARRIVING[1]), 2].mean(axis=0)
    arriving /= np.linalg.norm(arriving)
    half = shortest_turn(mean.apply([0.0, 0.0, 1.0]), arriving, share=0.5)
    rotation = (half * mean).as_matrix()
    return GraspPose(
        angles=np.median(observed.angles[lifted:][near], axis=0), rotation=rotation, position=-rotation @ wrist
    )
