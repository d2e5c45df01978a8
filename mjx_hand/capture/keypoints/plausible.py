"""The gate for keypoints, before and beside the fit of a hand."""

import numpy as np

from mjx_hand.capture.keypoints.bone_lengths import NUM_FINGER_BONES, lengths, median_lengths
from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.skeleton import rest_keypoints
from mjx_hand.hand.model import HandModel
from mjx_hand.motion.plausibility.finding import Finding, judged
from mjx_hand.motion.plausibility.pace import span_findings
from mjx_hand.motion.plausibility.points import (
    constancy_findings,
    picture_findings,
    place_findings,
    proportion_findings,
    variation,
)
from mjx_hand.pytree import replace


def keypoint_findings(recording: KeypointRecording, hand: HandModel) -> list[Finding]:
    """What about keypoints is not as `hand`'s, whatever its pose."""
    positions = np.asarray(recording.positions, float)
    bones = lengths(positions)[:, :NUM_FINGER_BONES]
    return [
        *(span_findings(float(recording.fps), recording.num_frames) if recording.fps is not None else []),
        *place_findings(positions, KEYPOINTS),
        *constancy_findings(bones),
        *picture_findings(positions, variation(bones)),
        *proportion_findings(median_lengths(positions), lengths(rest_keypoints(hand)[0])),
    ]


def plausible_keypoints(recording: KeypointRecording, hand: HandModel) -> KeypointRecording:
    """`recording` with a warning for what is doubtful about it.

    Raises:
        InputError: something is beyond doubt no hand's.
    """
    found = keypoint_findings(recording, hand)
    return replace(recording, warnings=judged(recording.source or "keypoints", found, recording.warnings))
