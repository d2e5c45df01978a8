"""Points of a hand: bones that keep their lengths, points of their own, hand-like proportions, metres, not pixels."""

import warnings
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from mjx_hand.motion.plausibility.finding import Finding, graded

Array = np.ndarray

# How much bones' lengths vary over time (`variation`): recordings from video
# have 0.05 to 0.10, image landmarks and joints of another order 0.1 to 0.4, noise
# alone 0.42.
WAVERING, NO_BONES = 0.2, 0.35
SAME_PLACE = 5e-4  # m; two joints are never that close
SOMETIMES, MOSTLY = 0.02, 0.5  # shares of the frames in which points coincide
# Factor by which a length differs from a mean hand's of the same size (root of the mean square of its logarithm):
# recordings have 1.12 to 1.15, Leap's bones 1.29; tips for bases 1.38 to 1.54, MANO's order 1.84 to 2.08.
UNLIKE, NO_HAND = 1.36, 1.75
# Mean distance of points from the fitted hand, in hand lengths: 0.03 to 0.041, with another order 0.10 to 0.29.
RESIDUAL, NO_FIT = 0.07, 0.2
IN_PICTURE = 1e-3  # image landmarks' wrist has depth 0: the others' are counted from it
FLAT_VARIES = 0.08  # how much bones vary, at least, where depth is a guess


def variation(lengths: Float[Array, "t n"]) -> float:
    """How much bone lengths (m; NaN where not seen) vary over time; single frames do not count.

    Half of what two thirds of the frames are within, which is a normal distribution's standard deviation, over the
    median; the mean over the bones.
    """
    with warnings.catch_warnings(), np.errstate(invalid="ignore", divide="ignore"):
        warnings.simplefilter("ignore", RuntimeWarning)  # bones that are never seen are NaN
        low, middle, high = np.nanpercentile(lengths, (15.9, 50, 84.1), axis=0)
        return float(np.nanmean((high - low) / 2 / middle))


def constancy_findings(lengths: Float[Array, "t n"]) -> list[Finding]:
    """On bone lengths (m) over time, NaN where not seen."""
    varies = variation(lengths)
    return graded(
        "bone lengths",
        varies,
        WAVERING,
        NO_BONES,
        f"vary by {100 * varies:.0f} % over time",
        f"below {100 * WAVERING:g} %",
        "check the order of the points, and that all are metres of one frame (no image landmarks)",
    )


def place_findings(points: Float[Array, "t n 3"], names: Sequence[str]) -> list[Finding]:
    """On points that lie at one place, NaN where not seen."""
    first, second = np.triu_indices(points.shape[1], 1)
    with np.errstate(invalid="ignore"):
        close = np.linalg.norm(points[:, first] - points[:, second], axis=-1) < SAME_PLACE
    seen = np.isfinite(points).all(axis=-1).sum(axis=-1) > 0
    if not close.any() or not seen.any():
        return []
    share = float(close[seen].any(axis=1).mean())
    worst = int(close.mean(axis=0).argmax())
    return graded(
        "points",
        share,
        SOMETIMES,
        MOSTLY,
        f"{names[first[worst]]} and {names[second[worst]]} at one place, in {100 * share:.0f} % of the frames",
        "each at its own",
        "leave points empty that were not seen",
    )


def proportion_findings(observed: Float[Array, "n"], expected: Float[Array, "n"]) -> list[Finding]:
    """On lengths (m; NaN where not known) beside those of a mean hand, whatever the size."""
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.log(observed / expected)
    known = ratio[np.isfinite(ratio)]
    if len(known) < len(expected) / 2:
        return []
    factor = float(np.exp(np.std(known)))
    return graded(
        "proportions",
        factor,
        UNLIKE,
        NO_HAND,
        f"bones differ from a hand's by a factor of {factor:.2f}",
        f"below {UNLIKE:g}",
        "check the order of the points: give their names, or the layout",
    )


def picture_findings(points: Float[Array, "t n 3"], varies: float) -> list[Finding]:
    """On points (the first is the wrist) that are places in a picture: x and y from 0 to 1, depth from the wrist's."""
    seen = points[np.isfinite(points).all(axis=(1, 2))]
    if not len(seen):
        return []
    wrist, across = seen[:, 0], np.ptp(seen[..., :2], axis=1).max(axis=-1)
    inside = ((seen[..., :2] >= 0) & (seen[..., :2] <= 1)).mean()
    no_depth = (np.abs(wrist[:, 2]) < IN_PICTURE).all() and (np.abs(wrist[:, :2]) > IN_PICTURE).any()
    if not (inside > 0.98 and no_depth):
        return []
    return [
        Finding(
            "coordinates",
            f"x and y within 0 to 1 and no depth at the wrist, a hand {np.median(across):.2f} wide",
            "metres",
            "these look like image landmarks; give the world landmarks",
            certain=bool(varies > FLAT_VARIES),
        )
    ]


def residual_findings(distance: float, size: float) -> list[Finding]:
    """On the mean distance (m) of what was recorded from the fitted hand of that length (m)."""
    share = distance / size
    return graded(
        "residual",
        share,
        RESIDUAL,
        NO_FIT,
        f"{1e3 * distance:.1f} mm from the fitted hand on average",
        f"below {1e3 * RESIDUAL * size:.0f}",
        "check the order of the points, the side, and the unit",
    )
