"""Keypoints to motion: the shape, wrist and joint rotations of the hand that has them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.capture.keypoint_fit.report import KeypointReport, make_report
from mjx_hand.capture.keypoint_fit.rotations import joint_rotations_along
from mjx_hand.capture.keypoint_fit.smooth import fill_short_gaps, low_pass_keypoints
from mjx_hand.capture.keypoints.bone_lengths import NUM_FINGER_BONES, median_lengths, shape_of_lengths
from mjx_hand.capture.keypoints.layouts import KEYPOINTS, PALM
from mjx_hand.capture.keypoints.plausible import keypoint_findings
from mjx_hand.capture.keypoints.recording import KeypointRecording, check_keypoints
from mjx_hand.capture.keypoints.size import check_size
from mjx_hand.capture.keypoints.skeleton import (
    BONES,
    Skeleton,
    bone_directions,
    own_skeleton,
    posed_keypoints,
    skeleton,
)
from mjx_hand.capture.pose.wrist import rigid_fit
from mjx_hand.errors import InputError
from mjx_hand.hand.model import HandModel
from mjx_hand.motion import Motion, check_motion
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.motion.plausibility.finding import judged
from mjx_hand.motion.plausibility.motions import plausible_motion
from mjx_hand.motion.plausibility.points import residual_findings
from mjx_hand.motion.resample import matrix_quaternions, quaternion_matrices

Array = np.ndarray

_MIDDLE_TIP = KEYPOINTS.index("middle_tip")


@dataclass(frozen=True)
class KeypointSettings:
    """How keypoints are made into a motion.

    Attributes:
        cutoff: of the low-pass filter before the fit, Hz; None leaves the recording's noise in.
        longest_gap: gaps of a keypoint up to this long (s) are bridged by straight lines; longer ones make their
            frames invalid.
        own_bones: give the motion the subject's own joint centres and finger tips beside the shape. Positions are
            nearer to the recording's then, but meshes and masses stay the mean hand's.
    """

    cutoff: float | None = None
    longest_gap: float = 0.2
    own_bones: bool = False


def fit_keypoints(
    recording: KeypointRecording, hand: HandModel, settings: KeypointSettings | None = None
) -> tuple[Motion, KeypointReport]:
    """The motion of `hand` that explains keypoints, and how well it does.

    Median bone lengths give the shape (`bone_lengths`), the palm's keypoints the wrist (least squares), the fingers'
    bones the rotations, with the roll that anatomy gives them (`rotations`). Finger bones are reproduced in direction
    exactly; their lengths are the fitted hand's, constant over time.

    Args:
        recording: keypoints of one hand of known rate; see `side.known_side` for its side.
        hand: the hand to fit, of the recording's side.
        settings: how.

    Returns:
        The motion, with a warning for what is doubtful about it, and a report on it. Frames with a long gap in any
        finger or the palm are not valid: their wrist is interpolated and their rotations are the identity.

    Raises:
        InputError: the recording's rate is not known, keypoints are never seen, no frame shows the whole hand, or its
            size or anything else (`motion.plausibility`) is no hand's.
    """
    settings = settings or KeypointSettings()
    check_keypoints(recording)
    name = recording.source or "keypoints"
    if recording.fps is None:
        raise InputError(f"{name}: does not say its frame rate; give fps, as in fps=30")
    never = [KEYPOINTS[k] for k in np.flatnonzero(~np.isfinite(recording.positions).any(axis=(0, 2))) if k > 0]
    if never:
        raise InputError(f"{name}: {', '.join(never)} never seen; every finger joint and tip is needed")
    observed = median_lengths(recording.positions)
    check_size(name, hand, observed)
    doubts = keypoint_findings(recording, hand)
    judged(name, doubts)  # before the fit: points of one place have no direction
    seen = fill_short_gaps(recording.positions, round(settings.longest_gap * recording.fps))
    if settings.cutoff is not None:
        seen = low_pass_keypoints(seen, recording.fps, settings.cutoff)

    shape = shape_of_lengths(hand, observed)
    rest = skeleton(hand, shape)
    turns, places, valid = _wrist(name, seen, rest)
    if settings.own_bones:
        bases = _finger_bases(recording.positions[valid], turns[valid], rest)
        bones = observed[:NUM_FINGER_BONES].reshape(5, 3)
        rest = own_skeleton(skeleton(hand, np.zeros(1)), hand.side, bones, bases)
        turns, places, valid = _wrist(name, seen, rest)
    rotations = np.tile(np.eye(3), (len(seen), 15, 1, 1))
    rotations[valid] = joint_rotations_along(bone_directions(seen[valid]), turns[valid], rest)
    motion = Motion(
        fps=recording.fps,
        rotations=rotations,
        wrist_position=fill_lines(places, valid),
        wrist_quaternion=fill_turns(matrix_quaternions(turns), valid),
        shape=shape,
        valid=valid,
        link_offset=rest.link_offset if settings.own_bones else None,
        tip_offset=rest.tip_offset if settings.own_bones else None,
        side=hand.side,
        source=f"{hand.name} fitted to {recording.source or 'keypoints'}",
        warnings=recording.warnings,
    )
    fitted = posed_keypoints(rest, rotations, quaternion_matrices(motion.wrist_quaternion), motion.wrist_position)
    report = make_report(recording.positions, fitted, valid)
    size = float(np.linalg.norm(rest.keypoints[_MIDDLE_TIP]))
    found = [
        *doubts,
        *residual_findings(_residual(recording.positions[valid], report.fitted[valid]), size),
    ]
    return plausible_motion(check_motion(motion), *found, name=name), report


def _residual(seen: Float[Array, "t 21 3"], fitted: Float[Array, "t 21 3"]) -> float:
    """The mean distance (m) of the keypoints that are seen, in the middle of the frames."""
    distance = np.linalg.norm(fitted - seen, axis=-1)
    known = np.isfinite(distance)
    return float(np.median(np.where(known, distance, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)))


def _wrist(
    name: str, seen: Float[Array, "t 21 3"], rest: Skeleton
) -> tuple[Float[Array, "t 3 3"], Float[Array, "t 3"], Bool[Array, "t"]]:
    """The wrist's pose in each frame, the identity where it is not valid, and which frames are."""
    palm = list(PALM)
    known = np.asarray(np.isfinite(seen).all(axis=-1))
    weight = known[:, palm].astype(float)
    turns, places, determined = rigid_fit(
        rest.keypoints[palm], np.where(known[:, palm, None], seen[:, palm], 0.0), weight
    )
    valid = determined & known[:, 1:].all(axis=1)
    if not valid.any():
        raise InputError(f"{name}: no frame shows a whole hand; fingers and palm are needed together in some frames")
    turns[~valid], places[~valid] = np.eye(3), 0.0
    return turns, places, valid


def _finger_bases(
    positions: Float[Array, "t 21 3"], turns: Float[Array, "t 3 3"], rest: Skeleton
) -> Float[Array, "5 3"]:
    """Where each finger begins relative to the wrist (m, hand axes): the median, or the shape's without a wrist."""
    bases = BONES[:, 0, 0]
    from_wrist = positions[:, bases] - positions[:, :1]
    if not np.isfinite(from_wrist).all(axis=(1, 2)).any():
        return rest.keypoints[bases]
    return np.nanmedian(np.einsum("tji,tkj->tki", turns, from_wrist), axis=0)
