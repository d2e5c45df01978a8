"""Whether keypoints are as big as a hand, and in which unit they would be."""

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.bone_lengths import NUM_FINGER_BONES, lengths
from mjx_hand.capture.keypoints.skeleton import rest_keypoints
from mjx_hand.errors import InputError
from mjx_hand.hand.model import HandModel

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}  # metres in each
_UNIT_WORDS = {
    f"{prefix}{word}{s}": f"{short}m"
    for prefix, short in (("", ""), ("centi", "c"), ("milli", "m"))
    for word in ("metre", "meter")
    for s in ("", "s")
}
BIGGEST = 1.8  # times the mean hand, or the other way its share; small children's hands are half an adult's


def unit_factor(name: str, unit: object) -> float:
    """Metres in one `unit`.

    Raises:
        InputError: the unit is unknown; `name` says where it stands.
    """
    known = _UNIT_WORDS.get(unit.lower().strip(), unit.lower().strip()) if isinstance(unit, str) else None
    if known not in UNITS:
        raise InputError(f"{name}: unit is {repr(unit)[:60]}; known: {', '.join(UNITS)}")
    return UNITS[known]


def check_size(name: str, hand: HandModel, observed: Float[np.ndarray, "n"]) -> None:
    """Refuse bone lengths (m) that no hand has.

    Raises:
        InputError: they are too big or too small, with the unit that would explain them.
    """
    fingers = slice(0, NUM_FINGER_BONES)
    ratio = float(np.nanmedian(observed[fingers] / lengths(rest_keypoints(hand)[0])[fingers]))
    if 1 / (1.4 * BIGGEST) < ratio < BIGGEST:
        return
    if not ratio > 0:
        raise InputError(f"{name}: all keypoints are at one place; is anything recorded there?")
    for unit, metres in UNITS.items():
        if unit != "m" and 1 / BIGGEST < ratio * metres < BIGGEST:
            raise InputError(
                f"{name}: a hand about {1 / metres:.0f} times too big, so positions are in {unit}; say "
                f"unit={unit!r} to mjx-hand keypoints"
            )
    what = f"{ratio:.3g} times too big" if ratio > 1 else f"{1 / ratio:.3g} times too small"
    raise InputError(
        f"{name}: a hand {what}; give positions in metres (of MediaPipe its world landmarks, not the image's)"
    )
