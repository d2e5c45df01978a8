"""How fast and how long: rate, span, and the speed of the wrist and of what moves in the hand."""

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.motion.plausibility.finding import Finding, graded

Array = np.ndarray

SLOW, FAST = 0.9, 1100.0  # frames/s; hands are recorded at 1 to 1000
VERY_SLOW, VERY_FAST = 1 / 3600, 20_000.0
LONG, VERY_LONG = 4 * 3600.0, 48 * 3600.0  # s of one recording
# Speeds (m/s) that a wrist is below in 19 of 20 frames: a hard throw reaches 10 for a tenth of a second (Fleisig et
# al., Kinetics of baseball pitching, 1995). Noise of video at 30/s adds 0.5.
SWIFT, IMPOSSIBLE = 10.0, 100.0
ENOUGH = 30  # steps from frame to frame, for a speed to be beyond doubt: fewer may be examples, not a recording


def span_findings(fps: float, frames: int) -> list[Finding]:
    """On the rate (frames/s) and the time that so many frames take."""
    advice = "check the unit of the times, or give the rate with --fps"
    span, rate = frames / fps, f"{fps:.3g} frames/s"
    return [
        *graded("rate", fps, FAST, VERY_FAST, rate, "1 to 1000", advice),
        *graded("rate", 1 / fps, 1 / SLOW, 1 / VERY_SLOW, rate, "1 to 1000", advice),
        *graded("time span", span, LONG, VERY_LONG, f"{span / 3600:.3g} h", f"up to {LONG / 3600:g}", advice),
    ]


def travel_findings(positions: Float[Array, "t 3"], valid: Bool[Array, "t"], fps: float) -> list[Finding]:
    """On the speed of the wrist (m) between frames that are both valid."""
    both = valid[1:] & valid[:-1]
    if not both.any():
        return []
    speed = float(np.percentile(np.linalg.norm(np.diff(positions, axis=0), axis=1)[both], 95)) * fps
    return graded(
        "wrist speed",
        speed,
        SWIFT,
        IMPOSSIBLE if both.sum() >= ENOUGH else np.inf,
        f"{speed:.3g} m/s in a twentieth of the frames",
        f"below {SWIFT:g}",
        "check the unit of the positions, and the rate",
    )
