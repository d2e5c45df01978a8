"""Ranges of motion of the 20 hinges, measured from the flat hand: hard limits, and soft ones within them.

*Hard* limits are what a joint allows when something else moves it, a little wider than a person moves it alone,
because an object in the hand bends fingers past what their own muscles do. *Soft* limits are what a person moves it
through alone, or what one person did in a recording; a controller should begin to give way there. Range at one joint
also depends on its neighbours, which fixed limits leave out.

Sources:
    AAOS: W. B. Greene and J. D. Heckman (eds.), The Clinical Measurement of Joint Motion, American Academy of
        Orthopaedic Surgeons, 1994.
    Hume: M. C. Hume et al., Functional range of motion of the joints of the hand, J Hand Surg Am 15(2), 1990,
        https://doi.org/10.1016/0363-5023(90)90102-W: active motion by goniometer.
    Hayashi: H. Hayashi, H. Shimizu, Essential motion of metacarpophalangeal joints during activities of daily living,
        J Hand Ther 26(1), 2013: MCP joints from -10 to 60 (index) and to 85 degrees (little finger) in 19 activities.
    Bain: G. I. Bain et al., The functional range of motion of the finger joints, J Hand Surg Eur 40(4), 2015: MCP 19 to
        71, PIP 23 to 87, DIP 10 to 64 degrees in nine of ten activities, half of what the joints can do.
    Eaton: C. Eaton, Normal Range of Motion Reference Values, http://e-hand.com/nor/nor002.htm: thumb MCP -10 to 55,
        IP -15 to 80; finger MCP 90, PIP 100, DIP 80 degrees.
    Barakat: M. J. Barakat, J. Field, J. Taylor, The range of movement of the thumb, Hand 8(2), 2013: thumb IP -12 to
        88, MCP -8 (0 to 15) to 60, CMC palmar abduction 61, radial abduction 63, adduction 10 degrees.
    Cooney: W. P. Cooney et al., The kinesiology of the trapeziometacarpal joint, J Bone Joint Surg Am 63(9), 1981:
        CMC 53 degrees of flexion-extension, 42 of abduction-adduction and 17 of rotation.
"""

import numpy as np
from jaxtyping import Array, Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGES
from mjx_hand.pytree import replace
from mjx_hand.rigid.rigid_hand import RigidHand

# Degrees. Abduction is positive towards the little finger for a finger, away from the index for the thumb.
_HARD: dict[str, tuple[int, int]] = {
    "mcp_abduction": (-25, 25),  # AAOS: 20 each way in extension; passive motion adds a few degrees
    "mcp_flexion": (-30, 100),  # Hume: 0 to 100 active; AAOS: 45 of extension, mostly passive
    "pip_flexion": (-10, 105),  # Hume: 0 to 105; extension of lax joints
    "dip_flexion": (-10, 90),  # AAOS: 0 to 90
    # The thumb's rest pose is already abducted, so the clinical ranges, counted from contact with the
    # index finger, are shifted: about half of the abduction is behind it.
    "thumb_cmc_abduction": (-35, 30),  # Barakat: 63 from contact; Cooney: 42 by roentgenogram, without the skin
    "thumb_cmc_flexion": (-20, 60),  # Barakat: 61 of palmar abduction and 10 of adduction behind the palm
    "thumb_mcp_flexion": (-15, 60),  # Barakat
    "thumb_ip_flexion": (-20, 88),  # AAOS: 20 of extension; Barakat: 88 of flexion
}
_SOFT: dict[str, tuple[int, int]] = {
    "mcp_abduction": (-20, 20),  # AAOS
    "mcp_flexion": (-20, 90),  # AAOS, Eaton; extension: twice what Hayashi's activities need
    "pip_flexion": (-5, 100),  # AAOS, Eaton: 0 to 100; the flat hand must not lie on the limit itself
    "dip_flexion": (-5, 80),  # Eaton: 0 to 80
    "thumb_cmc_abduction": (-30, 25),  # Cooney and Barakat: between 42 and 63 in all
    "thumb_cmc_flexion": (-15, 45),  # Cooney: 53 in all; Barakat: 61, with the skin
    "thumb_mcp_flexion": (-8, 55),  # Barakat, Eaton
    "thumb_ip_flexion": (-12, 80),  # Barakat, Eaton
}
_OUTER = (0.5, 99.5)  # percentiles that count as a recording's range: single frames are noise

Limits = tuple[Float[np.ndarray, "20"], Float[np.ndarray, "20"]]


def anatomical_limits() -> Limits:
    """Lower and upper hard limits (rad) in the order of `HINGES`; zero, the flat hand, lies inside each.

    Signs are those of `axes.anatomical_axes`, the same for both sides.
    """
    return _in_order(_HARD)


def active_limits() -> Limits:
    """Lower and upper soft limits (rad): what people move through alone; inside `anatomical_limits`, around zero."""
    return _in_order(_SOFT)


def limits_from_motion(
    rigid: RigidHand,
    angles: Float[Array | np.ndarray, "*b 20"],
    valid: Bool[Array | np.ndarray, "*b"] | None = None,
    *,
    margin: float = np.radians(5.0),
    widen: bool = False,
) -> RigidHand:
    """`rigid` with the range of a recording, and a margin on each side, as its soft limits.

    Args:
        rigid: the hand that the angles belong to.
        angles: a recording's hinge angles (rad), as `project` gives them, without its limits.
        valid: frames to use; all if None.
        margin: added on each side (rad), at least 0.
        widen: where the recording goes past the hard limits, move these too (a lax joint; also what noise and
            another zero of the angles look like). Otherwise soft limits stay within the hard ones.

    Raises:
        InputError: no valid frame, angles that are not finite, or a margin below 0.
    """
    angles = np.asarray(angles, dtype=float)
    kept = angles.reshape(-1, len(HINGES)) if valid is None else angles[np.asarray(valid)]
    if not len(kept):
        raise InputError(f"none of {angles[..., 0].size} frames is valid; limits need a recording of the hand's motion")
    if not np.isfinite(kept).all():
        raise InputError("the angles have NaN or infinity in frames that count as valid; mark those as not valid")
    if not (np.isfinite(margin) and margin >= 0):
        raise InputError(f"margin is {margin}; give an angle (rad) of at least 0")
    low, high = np.percentile(kept, _OUTER, axis=0) + np.array([[-margin], [margin]])
    lower, upper = np.asarray(rigid.hinge_lower, dtype=float), np.asarray(rigid.hinge_upper, dtype=float)
    if widen:
        lower, upper = np.minimum(lower, low), np.maximum(upper, high)
    # A range that lies wholly outside leaves a strip at the limit, never an empty or inverted one.
    strip = 0.05 * (upper - lower)
    return replace(
        rigid,
        hinge_lower=lower,
        hinge_upper=upper,
        soft_lower=np.clip(low, lower, upper - strip),
        soft_upper=np.clip(high, lower + strip, upper),
    )


def _in_order(ranges: dict[str, tuple[int, int]]) -> Limits:
    pairs = [ranges.get(hinge) or ranges[hinge.split("_", 1)[1]] for hinge in HINGES]
    lower, upper = np.deg2rad(np.array(pairs, dtype=float)).T
    return lower, upper
