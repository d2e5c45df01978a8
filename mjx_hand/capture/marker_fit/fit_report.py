"""`FitReport`: how well a fit explains its recording."""

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.capture.marker_fit.track import Track
from mjx_hand.capture.markers.marker_set import MarkerSet
from mjx_hand.errors import InputError
from mjx_hand.pytree import pytree, static

MAX_REJECTED = 0.5  # share of its frames in which a marker may be too far from the hand to be believed


@pytree
class FitReport:
    """How well a fit explains its recording.

    Attributes:
        marker_rms: RMS distance (m) of each marker from the fitted hand where it was seen; zero if it never was.
        rms: the same over all markers.
        offsets: how far (m, hand axes at rest) each marker was found from where the marker set puts it.
        distance: of each marker in each frame of the recording (m); zero where it was not seen or nothing was fitted.
        seen: whether it was, and the frame was fitted.
        rejected: of each marker, the share of these frames in which it was too far from the hand to be believed.
        names: the markers, in the marker set's order.
    """

    marker_rms: Float[np.ndarray, "m"]
    rms: float
    offsets: Float[np.ndarray, "m 3"]
    distance: Float[np.ndarray, "t m"]
    seen: Bool[np.ndarray, "t m"]
    rejected: Float[np.ndarray, "m"]
    names: tuple[str, ...] = static()


def make_report(
    track: Track,
    residual: Float[np.ndarray, "b m 3"],
    offsets: Float[np.ndarray, "m 3"],
    marker_set: MarkerSet,
    outlier: float,
    max_distance: float,
) -> FitReport:
    """The report of a fit whose markers are `residual` (m) away.

    Raises:
        InputError: a marker is rejected (further away than `outlier`) in most frames, or its offset is above both
            `max_distance` and what the marker set allows. Offsets give swapped names away: they soak up the
            centimetres that the swap makes, and leave a small residual.
    """
    shape = (track.recording.num_frames, len(marker_set.names))
    distance, seen = np.zeros(shape), np.zeros(shape, bool)
    seen[track.frames] = track.visible
    distance[track.frames] = np.where(track.visible, np.linalg.norm(residual.astype(np.float64), axis=-1), 0.0)
    frames = np.maximum(seen.sum(axis=0), 1)
    marker_rms = np.sqrt((distance**2).sum(axis=0) / frames)
    rejected = (distance > outlier).sum(axis=0) / frames
    moved = np.linalg.norm(offsets, axis=1)
    off = np.where(rejected > MAX_REJECTED, marker_rms, moved)
    allowed = np.maximum(max_distance, 3 * marker_set.place_deviation)
    bad = np.flatnonzero((rejected > MAX_REJECTED) | (moved > allowed))
    if bad.size:
        worst = ", ".join(f"{marker_set.names[m]} {1000 * off[m]:.0f} mm" for m in bad[np.argsort(-off[bad])][:4])
        raise InputError(
            f"{track.recording.source or 'recording'}: no hand explains these markers ({worst} off, at most "
            f"{1000 * allowed[bad].min():.0f} allowed); check for swapped names, the marker set, and the hand's side"
        )
    rms = float(np.sqrt((distance**2).sum() / seen.sum()))
    return FitReport(
        marker_rms=marker_rms,
        rms=rms,
        offsets=offsets,
        distance=distance,
        seen=seen,
        rejected=rejected,
        names=marker_set.names,
    )
