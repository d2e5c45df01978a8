"""Markers to motion: the pose, wrist, shape and skin offsets that explain a marker recording."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.capture.marker_fit.batches import Meter, padded, part, solve_all
from mjx_hand.capture.marker_fit.fit_report import FitReport, make_report
from mjx_hand.capture.marker_fit.linearise import PoseState
from mjx_hand.capture.marker_fit.shape_solver import Subject, solve_subject
from mjx_hand.capture.marker_fit.skinned_points import skinned_points
from mjx_hand.capture.marker_fit.smoothing import smooth_vectors
from mjx_hand.capture.marker_fit.stages import begin, between_keyframes, drawn_towards, joined, keyframes
from mjx_hand.capture.marker_fit.track import Track, make_track, palm_weights
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.capture.markers.marker_set import MarkerSet, rest_offsets
from mjx_hand.capture.pose.pose_prior import habitual_pose, joint_precision, pose_prior
from mjx_hand.errors import InputError
from mjx_hand.hand.model import HandModel
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.plausibility.motions import plausible_motion
from mjx_hand.motion.plausibility.points import residual_findings
from mjx_hand.motion.resample import matrix_quaternions
from mjx_hand.pytree import replace

MAX_SHAPE = 10  # coefficients fitted: markers see no more
KEYFRAMES = 48  # frames from which a recording's shape and skin offsets are taken
# How many of them count as independent draws from the pose prior. A person's habitual pose is one draw, not 48: counted
# in full, the prior drags all poses towards its mean and the offsets pay for it (2 mm at the finger tips).
INDEPENDENT = 2.4
# How far (m) a marker coordinate is from the model while the shape is the mean one. Believed more, markers fold a
# joint the wrong way to make up for a bone's length.
MEAN_SHAPE_DEVIATION = 0.005
# How far (m) from the model a marker counts as wrong: on the mean shape, with the shape, from key frames.
OUTLIERS = (0.05, 0.01, 0.03)
KNOWN = 1e-3  # standard deviation of a shape coefficient that is known
KEYFRAME_STEPS, SUBJECT_STEPS, FRAME_STEPS, SMOOTH_STEPS = 15, 18, 4, 4


@dataclass(frozen=True)
class FitSettings:
    """What the fit believes of the recording.

    Attributes:
        marker_deviation: standard deviation of a marker coordinate about the model, m: noise and moving skin.
        shape: shape coefficients that are known, such as those of an earlier fit of the same person; None to find them.
        min_visible: markers that a frame must show to be valid.
        acceleration: standard deviation of the angular acceleration of a finger joint, rad/s^2.
        smoothing_deviation: how far (rad) a joint is expected to be from the smooth course.
        max_distance: how far (m) a marker may be from the fitted hand (RMS), or be found from where the marker set
            puts it, before the recording is refused.
        outlier: how far (m) from the fitted hand a marker loses most of its say: swapped for a moment, or a ghost.
    """

    marker_deviation: float = 0.001
    shape: tuple[float, ...] | None = None
    min_visible: int = 8
    acceleration: float = 50.0
    smoothing_deviation: float = 0.05
    max_distance: float = 0.010
    outlier: float = 0.010

    def __post_init__(self) -> None:
        known = self.shape or ()
        if len(known) > MAX_SHAPE or not np.isfinite(known).all():
            raise InputError(
                f"fit setting shape has {len(known)} coefficients, expected up to {MAX_SHAPE} finite numbers"
            )
        for name, value in vars(self).items():
            if name != "shape" and not (np.isfinite(value) and value > 0):
                raise InputError(f"fit setting {name} is {value}, expected a number above 0")


def fit_markers(
    recording: MarkerRecording, hand: HandModel, marker_set: MarkerSet, settings: FitSettings | None = None
) -> tuple[Motion, FitReport]:
    """The motion of `hand` that explains one recording, and how well it does; see `fit_many`."""
    return fit_many([recording], hand, marker_set, settings)[0]


def fit_many(
    recordings: Sequence[MarkerRecording],
    hand: HandModel,
    marker_set: MarkerSet,
    settings: FitSettings | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[tuple[Motion, FitReport]]:
    """The motions of `hand` that explain recordings, each of a subject of its own, in one batch.

    Four stages: poses of up to 48 frames per recording on the mean shape; the recording's shape and skin offsets
    together with these poses; all frames' poses from there; the same again, drawn towards the frames around each.

    Args:
        recordings: markers with names of the marker set; those of the set that are missing count as hidden.
        hand: the hand to fit.
        marker_set: where the markers are, resolved onto this hand.
        settings: what is believed of the recordings.
        progress: told the share of the work done, from 0 to 1.

    Returns:
        For each recording its motion and a report. Frames with too few markers are not valid: their wrist is
        interpolated and their rotations are the identity.

    Raises:
        InputError: a recording has unknown markers or nothing to fit, or a marker cannot be explained (two names
            swapped, or millimetres taken for metres).
    """
    settings = settings or FitSettings()
    points = skinned_points(hand, marker_set.vertices, rest_offsets(marker_set, hand), MAX_SHAPE)
    prior = pose_prior(hand)
    palm = palm_weights(np.asarray(hand.weights)[marker_set.vertices, 0])
    tracks = [make_track(recording, marker_set, settings.min_visible) for recording in recordings]
    keys = [keyframes(track, KEYFRAMES) for track in tracks]
    frame_steps = sum(len(track.frames) for track in tracks) * (FRAME_STEPS + SMOOTH_STEPS)
    meter = Meter(progress, sum(map(len, keys)) * (KEYFRAME_STEPS + SUBJECT_STEPS) + frame_steps)

    known = np.zeros(points.rest_directions.shape[-1], np.float32)
    known[: len(settings.shape or ())] = settings.shape or ()
    expected = Subject(shape=jnp.asarray(known), offsets=jnp.zeros((len(marker_set.names), 3)))
    starts = [begin(track, points, expected, palm, prior, MEAN_SHAPE_DEVIATION, OUTLIERS[0]) for track in tracks]
    chosen = [part(frames, state, key) for (frames, state), key in zip(starts, keys, strict=True)]
    # Both solvers are compiled until the first subject is found, a minute when nothing is kept from before. All that is
    # told as one piece of work: from the pace between the two, the time left would be put at half an hour.
    poses = solve_all(points, *joined(chosen), KEYFRAME_STEPS, Meter(None, 0)).state

    place_deviation = jnp.asarray(marker_set.place_deviation, jnp.float32)
    shape_deviation = jnp.asarray(1.0 if settings.shape is None else KNOWN)
    subjects, starts = [], []
    bounds = np.cumsum([0, *map(len, keys)])
    for i, (track, key) in enumerate(zip(tracks, keys, strict=True)):
        pose = jax.tree.map(lambda a, i=i: a[bounds[i] : bounds[i + 1]], poses)
        frames = chosen[i][0]
        weakened = replace(
            frames,
            weight=frames.weight * (MEAN_SHAPE_DEVIATION / settings.marker_deviation) ** 2,
            precision=frames.precision * min(INDEPENDENT / len(key), 1.0),
            outlier=np.float32(OUTLIERS[1]),
        )
        some = jax.tree.map(jnp.asarray, padded(weakened, pose, KEYFRAMES))
        subject, pose = solve_subject(
            points, *some, expected, shape_deviation, place_deviation, jnp.asarray(SUBJECT_STEPS)
        )
        frames, state = begin(track, points, subject, palm, prior, settings.marker_deviation, OUTLIERS[2])
        vectors = np.asarray(pose.vectors)[: len(key)]
        habit = np.broadcast_to(habitual_pose(prior, vectors), frames.mean.shape)
        subjects.append(subject)
        starts.append(
            (replace(frames, mean=habit), replace(state, vectors=between_keyframes(track.frames, key, vectors)))
        )
        meter.add(len(key) * (KEYFRAME_STEPS + SUBJECT_STEPS))

    frames, state = joined(starts)
    found = solve_all(points, frames, state, FRAME_STEPS, meter)
    bounds = np.cumsum([0, *(len(track.frames) for track in tracks)])
    windows = [slice(a, b) for a, b in itertools.pairwise(bounds)]
    smooth = []
    for at, track in zip(windows, tracks, strict=True):
        jerkiness = settings.acceleration / track.recording.fps**2
        precision = joint_precision(np.asarray(prior.precision))
        smooth.append(smooth_vectors(found.state.vectors[at], found.covariance[at], precision, track.frames, jerkiness))
    frames = drawn_towards(frames, np.concatenate(smooth), settings.smoothing_deviation)
    frames = replace(frames, outlier=np.float32(settings.outlier))
    found = solve_all(points, frames, found.state, SMOOTH_STEPS, meter)

    out = []
    for at, track, subject in zip(windows, tracks, subjects, strict=True):
        motion = make_motion(track, jax.tree.map(lambda a, at=at: a[at], found.state), subject, hand)
        offsets = np.asarray(subject.offsets)
        report = make_report(track, found.residual[at], offsets, marker_set, settings.outlier, settings.max_distance)
        residual = residual_findings(report.rms, float(np.ptp(np.asarray(hand.template), axis=0).max()))
        name = track.recording.source or "recording"
        out.append((plausible_motion(motion, *residual, name=name), report))
    return out


def make_motion(track: Track, state: PoseState, subject: Subject, hand: HandModel) -> Motion:
    """The motion of a track's fitted frames, with the frames it left out marked as not valid."""
    count = track.recording.num_frames
    valid = np.zeros(count, bool)
    valid[track.frames] = True
    rotations = np.tile(np.eye(3), (count, 15, 1, 1))
    vectors = state.vectors.astype(np.float64).reshape(-1, 3)
    rotations[track.frames] = Rotation.from_rotvec(vectors).as_matrix().reshape(-1, 15, 3, 3)
    wrist_rotation, wrist_position = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    wrist_rotation[track.frames] = state.wrist_rotation
    wrist_position[track.frames] = state.wrist_position + track.shift
    return Motion(
        fps=track.recording.fps,
        rotations=rotations,
        wrist_position=fill_lines(wrist_position, valid),
        wrist_quaternion=fill_turns(matrix_quaternions(wrist_rotation), valid),
        shape=np.asarray(subject.shape, np.float64),
        valid=valid,
        side=hand.side,
        source=f"{hand.name} fitted to {track.recording.source or 'a marker recording'}",
        warnings=track.recording.warnings,
    )
