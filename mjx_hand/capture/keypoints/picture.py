"""Whether keypoints look like landmarks of a picture: shares of its width and height, which are no places."""

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.bone_lengths import mean_lengths, median_lengths

_INSIDE = 0.98  # share of the points that lie in the picture
_WIDTHS = (16 / 9, 4 / 3, 3 / 2, 3 / 4, 2 / 3, 9 / 16)  # of pictures over their heights
_BETTER = 0.7  # share of the misfit below which a hand is far more like one once the picture has its width


def picture_warning(positions: Float[np.ndarray, "t 21 3"]) -> tuple[str, ...]:
    """A warning where x and y lie within 0 to 1, and bones are far more like a hand's as those of an oblong picture.

    In a picture that is wider than high a share of its width is longer than one of its height (depth counts as width).
    """
    seen = positions[np.isfinite(positions).all(axis=-1)]
    inside = ((seen[:, :2] >= 0) & (seen[:, :2] <= 1)).all(axis=-1)
    if not len(seen) or inside.mean() < _INSIDE:
        return ()
    as_it_is = _misfit(positions)
    if not min(_misfit(positions * [width, 1.0, width]) for width in _WIDTHS) < _BETTER * as_it_is:
        return ()
    return (
        "x and y lie within 0 to 1, and bones are a hand's only as shares of an oblong picture: these look like "
        "landmarks of the image; give the world landmarks, which are metres",
    )


def _misfit(positions: Float[np.ndarray, "t 21 3"]) -> float:
    """How unlike the proportions are to the mean hand's: the deviation of the logarithms of length over length."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(median_lengths(positions) / mean_lengths())
    known = ratio[np.isfinite(ratio)]
    return float(np.std(known)) if len(known) else 0.0
