"""`FitReport`: how well a fit explains its recording."""

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.track import Track
from mjx_hand.errors import InputError
from mjx_hand.pytree import pytree, static


@pytree
class FitReport:
    """How well a fit explains its recording.

    Attributes:
        marker_rms: RMS distance (m) of each marker from the fitted hand where it was seen; zero if it never was.
        rms: the same over all markers.
        offsets: how far (m, hand axes at rest) each marker was found from where the marker set puts it.
        iterations: solver steps that each frame went through.
        names: the markers, in the marker set's order.
    """

    marker_rms: Float[np.ndarray, "m"]
    rms: float
    offsets: Float[np.ndarray, "m 3"]
    iterations: int = static()
    names: tuple[str, ...] = static()


def make_report(
    track: Track,
    residual: Float[np.ndarray, "b m 3"],
    offsets: Float[np.ndarray, "m 3"],
    names: tuple[str, ...],
    iterations: int,
    max_distance: float,
) -> FitReport:
    """The report of a fit whose markers are `residual` (m) away.

    Raises:
        InputError: a marker's RMS distance, or its offset, is above `max_distance`. Offsets give swapped names away:
            they soak up the centimetres that the swap makes, and leave a small residual.
    """
    squared = np.where(track.visible, (residual.astype(np.float64) ** 2).sum(axis=-1), 0.0)
    marker_rms = np.sqrt(squared.sum(axis=0) / np.maximum(track.visible.sum(axis=0), 1))
    off = np.maximum(marker_rms, np.linalg.norm(offsets, axis=1))
    bad = np.flatnonzero(off > max_distance)
    if bad.size:
        worst = ", ".join(f"{names[m]} {1000 * off[m]:.0f} mm" for m in bad[np.argsort(-off[bad])][:4])
        raise InputError(
            f"{track.recording.source or 'recording'}: no hand explains these markers ({worst} off, at most "
            f"{1000 * max_distance:.0f} allowed); check for swapped names, the hand's side and metres"
        )
    rms = float(np.sqrt(squared.sum() / track.visible.sum()))
    return FitReport(marker_rms=marker_rms, rms=rms, offsets=offsets, iterations=iterations, names=names)
