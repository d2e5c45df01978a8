"""Postures that show what rigid links do to a hand's skin: hinge angles by name."""

import numpy as np
from jaxtyping import Float

from mjx_hand.hand.joints import FINGERS, HINGES

_GRADES = (30, 60, 90)  # degrees


def postures(lower: Float[np.ndarray, "20"], upper: Float[np.ndarray, "20"]) -> dict[str, Float[np.ndarray, "_ 20"]]:
    """Hinge angles (rad) of a fist, a pinch, spread fingers, and each flexion alone in steps, by name.

    Args:
        lower, upper: limits (rad), which no posture goes beyond.
    """
    # Degrees; a finger's are abduction (positive towards the little finger), then flexions from the base outwards.
    named: dict[str, list[list[int]]] = {
        "fist": [_hand((0, 60, 70, 40), thumb=(0, 40, 30, 30))],
        "pinch": [_hand((0, 20, 20, 10), index=(0, 45, 40, 30), middle=(0, 30, 30, 20), thumb=(10, 35, 20, 15))],
        "spread": [
            _hand((0, 0, 0, 0), index=(-15, 0, 0, 0), ring=(10, 0, 0, 0), pinky=(18, 0, 0, 0), thumb=(20, -10, 0, 0))
        ],
    }
    for kind in ("mcp", "pip", "dip"):
        named[f"{kind} flexion"] = _graded([h for h in HINGES if h.endswith(f"{kind}_flexion") and "thumb" not in h])
    named["thumb flexion"] = _graded([h for h in HINGES if h.startswith("thumb") and h.endswith("flexion")])
    return {name: np.clip(np.deg2rad(np.array(rows, float)), lower, upper) for name, rows in named.items()}


def _hand(others: tuple[int, ...], **fingers: tuple[int, ...]) -> list[int]:
    return [angle for finger in FINGERS for angle in fingers.get(finger, others)]


def _graded(hinges: list[str]) -> list[list[int]]:
    """Each hinge alone at each grade."""
    return [[grade * (name == hinge) for name in HINGES] for hinge in hinges for grade in _GRADES]
