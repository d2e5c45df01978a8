"""Ranges of motion of the 20 hinges, from goniometry, measured from the flat hand.

Sources:
    AAOS: W. B. Greene and J. D. Heckman (eds.), The Clinical Measurement of Joint Motion, American Academy of
        Orthopaedic Surgeons, 1994.
    Hume: M. C. Hume et al., Functional range of motion of the joints of the hand, J Hand Surg Am 15(2), 1990,
        https://doi.org/10.1016/0363-5023(90)90102-W.
    Barakat: M. J. Barakat, J. Field, J. Taylor, The range of movement of the thumb, Hand 8(2), 2013: thumb IP -12 to
        88, MCP -8 (0 to 15) to 60, CMC palmar abduction 61, radial abduction 63, adduction 10 degrees.
    Cooney: W. P. Cooney et al., The kinesiology of the trapeziometacarpal joint, J Bone Joint Surg Am 63(9), 1981:
        CMC 53 degrees of flexion-extension, 42 of abduction-adduction and 17 of rotation.

The ranges are of joints that can be moved passively, a little wider than a person moves them alone, because an object
in the hand bends fingers past what their own muscles do. Range at one joint also depends on its neighbours, which
fixed limits leave out.
"""

import numpy as np
from jaxtyping import Float

from mjx_hand.hand.joints import HINGES

# Degrees. Abduction is positive towards the little finger for a finger, away from the index for the thumb.
_RANGES: dict[str, tuple[float, float]] = {
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


def anatomical_limits() -> tuple[Float[np.ndarray, "20"], Float[np.ndarray, "20"]]:
    """Lower and upper limits (rad) in the order of `HINGES`; zero, the flat hand, lies inside each.

    Signs are those of `axes.anatomical_axes`, the same for both sides.
    """
    pairs = [_RANGES.get(hinge) or _RANGES[hinge.split("_", 1)[1]] for hinge in HINGES]
    lower, upper = np.deg2rad(np.array(pairs, dtype=float)).T
    return lower, upper
