"""Poses: rotations and joint angles beyond anatomy, fingers that bend as the other hand's, and the shape's size."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.motion.plausibility.finding import Finding, graded

Array = np.ndarray

# Standard deviations of people's hands in one direction of shape: one in 10^4 is beyond 4. Recordings have up to 2.3,
# joints in another order than they are read 4 to 9.
LARGE_SHAPE, NO_SHAPE = 5.0, 15.0
# Degrees by which a finger joint's rotation is from the flat hand's. Flexed fully it is 105; MANO's order read as
# MediaPipe's gives 170 in the middle of the frames, tips for bases 150.
FAR_TURN, NO_TURN = 130.0, 145.0
FEW, MOST = 0.1, 0.5  # shares of the frames in which a thing is doubtful, and wrong
# Mean bend (degrees) of the fingers' outer joints, backwards. The flattest recording has 3 forwards, mirrored ones
# 10 to 44 backwards.
BACK, BACKWARDS = 3.0, 15.0
# Degrees beyond the range of motion (`rigid.limits`).
BEYOND, FAR_BEYOND = 30.0, 60.0
_OUTER = (1, 2, 4, 5, 7, 8, 10, 11)  # of MANO's 15 joints: the outer two of index, middle, little and ring finger


def shape_findings(shape: Float[Array, "s"]) -> list[Finding]:
    """On shape coefficients, in standard deviations of people's hands."""
    most = float(np.abs(shape).max(initial=0.0))
    return graded(
        "shape coefficients",
        most,
        LARGE_SHAPE,
        NO_SHAPE,
        f"up to {most:.3g}",
        f"within {LARGE_SHAPE:g}",
        "check the order of the points and their unit",
    )


def turn_findings(vectors: Float[Array, "t 15 3"], side: str) -> list[Finding]:
    """On the joints' rotations (rotation vectors, rad, about the flat hand, MANO's axes) in frames that are valid.

    MANO's fingers lie along x and bend about z; a left hand is the mirror image in x.
    """
    if not len(vectors):
        return []
    turn = np.degrees(np.linalg.norm(vectors, axis=-1)).max(axis=1)
    share = float((turn > FAR_TURN).mean())
    wrong = float((turn > NO_TURN).mean()) > MOST
    found = []
    if share > FEW or wrong:
        found.append(
            Finding(
                "joint rotations",
                f"over {FAR_TURN:g} degrees in {100 * share:.0f} % of the frames",
                f"at most in {100 * FEW:g} %",
                "check the order of the joints, and whether poses are about the flat hand",
                certain=wrong,
            )
        )
    bend = np.degrees(vectors[:, _OUTER, 2]) * (1 if side == "right" else -1)
    back = -float(np.median(bend.mean(axis=1)))
    other = "left" if side == "right" else "right"
    return found + graded(
        "bend of the fingers",
        back,
        BACK,
        BACKWARDS,
        f"{back:.0f} degrees backwards, as a {other} hand's",
        f"a {side} hand's",
        f"try side={other!r}, or negate one axis if the frame is left-handed",
    )


def angle_findings(
    angles: Float[Array, "t h"],
    lower: Float[Array, "h"],
    upper: Float[Array, "h"],
    valid: Bool[Array, "t"],
    names: Sequence[str],
) -> list[Finding]:
    """On hinge angles (rad) against the joints' ranges of motion, over valid frames."""
    beyond = np.degrees(np.maximum(np.maximum(angles - upper, lower - angles), 0.0))[valid]
    if not len(beyond):
        return []
    share = float((beyond > BEYOND).any(axis=1).mean())
    wrong = float((beyond > FAR_BEYOND).any(axis=1).mean()) > MOST
    if not (share > FEW or wrong):
        return []
    worst = names[int(np.median(beyond, axis=0).argmax() if wrong else (beyond > BEYOND).mean(axis=0).argmax())]
    return [
        Finding(
            "joint angles",
            f"over {BEYOND:g} degrees beyond their range in {100 * share:.0f} % of the frames, most {worst}",
            f"at most in {100 * FEW:g} %",
            "check the side, the order of the joints, and the marker set or unit",
            certain=wrong,
        )
    ]
