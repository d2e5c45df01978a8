"""A recording made ready to fit: its usable frames, in the marker set's order, near the origin."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mjx_hand.capture.markers.marker_recording import MarkerRecording, check_recording
from mjx_hand.capture.markers.marker_set import MarkerSet
from mjx_hand.capture.markers.outliers import excursions
from mjx_hand.capture.pose.wrist import rigid_fit
from mjx_hand.errors import InputError
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.motion.resample import matrix_quaternions, quaternion_matrices

PALM = 0.25  # least weight of the wrist's link at a marker that tells where the wrist is
MIN_PALM = 3
# A hand is never this many times as large or as small as the mean one; a wrong unit is off by ten or more.
TOO_BIG = 3.2

Array = np.ndarray


@dataclass(frozen=True)
class Track:
    """The frames of one recording that show enough of the hand.

    Attributes:
        recording: where they come from.
        frames: their numbers in the recording.
        observed: marker positions in the marker set's order (m), less `shift`.
        visible: which were seen.
        believed: which of these the fit starts from: all but those of a marker that leaps away and back.
        shift: mean of each frame's believed markers (m, the recording's frame): single precision then suffices
            wherever the capture system's origin is.
    """

    recording: MarkerRecording
    frames: Int[Array, "b"]
    observed: Float[Array, "b m 3"]
    visible: Bool[Array, "b m"]
    believed: Bool[Array, "b m"]
    shift: Float[Array, "b 3"]


def make_track(recording: MarkerRecording, marker_set: MarkerSet, min_visible: int) -> Track:
    """The usable frames: those with at least `min_visible` of the set's markers.

    Raises:
        InputError: a marker's name is not in the set, or no frame is usable.
    """
    check_recording(recording)
    name = recording.source or "recording"
    unknown = [n for n in recording.names if n not in marker_set.names]
    if unknown:
        raise InputError(
            f"{name}: unknown marker {', '.join(map(repr, unknown))}; the marker set has "
            f"{', '.join(marker_set.names)}; rename it, or leave it out with select_markers"
        )
    at = [marker_set.names.index(n) for n in recording.names]
    observed = np.zeros((recording.num_frames, len(marker_set.names), 3))
    visible = np.zeros(observed.shape[:2], bool)
    observed[:, at], visible[:, at] = recording.positions, recording.visible
    believed = visible & ~excursions(observed, visible, recording.fps)
    frames = np.flatnonzero(believed.sum(axis=1) >= min_visible)
    if frames.size == 0:
        never = [n for m, n in enumerate(marker_set.names) if not believed[:, m].any()]
        lacking = f" (never seen: {', '.join(never)})" if never else ""
        raise InputError(f"{name}: no frame shows {min_visible} markers of the set{lacking}; nothing to fit")
    observed, visible, believed = observed[frames], visible[frames], believed[frames]
    shift = np.einsum("bm,bmc->bc", believed, observed) / believed.sum(axis=1)[:, None]
    observed = np.where(visible[..., None], observed - shift[:, None], 0.0)
    return Track(recording=recording, frames=frames, observed=observed, visible=visible, believed=believed, shift=shift)


def palm_weights(wrist_weight: Float[Array, "m"]) -> Float[Array, "m"]:
    """How much each marker says about the wrist, from the wrist's skinning weight at it.

    Raises:
        InputError: fewer than three markers are on the palm.
    """
    weights = np.where(wrist_weight >= PALM, wrist_weight**2, 0.0)
    if (weights > 0).sum() < MIN_PALM:
        raise InputError(
            f"the marker set has {(weights > 0).sum()} markers on the wrist and palm; at least {MIN_PALM} are needed"
        )
    return weights


def check_scale(track: Track, rest: Float[Array, "m 3"], palm: Float[Array, "m"]) -> None:
    """Refuse a recording in another unit than it says.

    Raises:
        InputError: the palm's markers are many times further apart, or closer together, than on the hand.
    """
    weight = palm * track.believed
    total = np.maximum(weight.sum(axis=1), 1e-12)[:, None]
    size = []
    for points in (track.observed, np.broadcast_to(rest, track.observed.shape)):
        off = points - (np.einsum("tm,tmc->tc", weight, points) / total)[:, None]
        size.append(np.einsum("tm,tmc->t", weight, off**2))
    known = ((weight > 0).sum(axis=1) >= MIN_PALM) & (size[1] > 0)
    if not known.any():
        return
    ratio = float(np.sqrt(np.median(size[0][known] / size[1][known])))
    if not 1 / TOO_BIG < ratio < TOO_BIG:
        wrong = round(abs(np.log10(max(ratio, 1e-9))))  # units are powers of ten apart, hands differ by less
        times = f"about {10**wrong} times too {'big' if ratio > 1 else 'small'}"
        hint = (
            "millimetres were taken for metres: read it with --units mm"
            if wrong == 3 and ratio > 1
            else "check its unit: --units"
        )
        raise InputError(f"{track.recording.source or 'recording'}: the hand is {times}; {hint}")


def wrist_guess(
    track: Track, rest: Float[Array, "m 3"], palm: Float[Array, "m"]
) -> tuple[Float[Array, "b 3 3"], Float[Array, "b 3"]]:
    """Wrist rotation and position (m, less `shift`) from the palm's markers at rest relative to the wrist joint.

    Raises:
        InputError: no frame's markers determine it, or they are those of a hand many times too big or small.
    """
    check_scale(track, rest, palm)
    rotation, position, known = rigid_fit(rest, track.observed, palm * track.believed)
    if not known.any():
        name = track.recording.source or "recording"
        raise InputError(
            f"{name}: no frame shows {MIN_PALM} markers of the palm that are not on a line; nothing to fit"
        )
    rotation = quaternion_matrices(fill_turns(matrix_quaternions(rotation), known))
    return rotation, fill_lines(position + track.shift, known) - track.shift
