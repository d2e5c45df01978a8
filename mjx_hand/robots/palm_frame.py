"""Keypoints as seen from the palm, in the directions of a robot hand's own frame."""

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.errors import InputError

_WRIST, _INDEX, _MIDDLE, _RING = (KEYPOINTS.index(k) for k in ("wrist", "index_mcp", "middle_mcp", "ring_mcp"))
_LEAST = 1e-6  # m^2; of the palm's triangle, below which it has no direction


def palm_axes(keypoints: Float[np.ndarray, "*b 21 3"], side: str) -> Float[np.ndarray, "*b 3 3"]:
    """The palm's axes as columns: towards the fingers, out of the palm, and their cross product.

    From the wrist and the knuckles of index, middle and ring finger; NaN where one is missing or they are in line.

    Args:
        keypoints: m.
        side: "right" or "left"; which way is out of the palm.

    Raises:
        InputError: unknown side.
    """
    if side not in ("right", "left"):
        raise InputError(f"side is {side!r}; give 'right' or 'left'")
    points = np.asarray(keypoints, float)
    along = points[..., _MIDDLE, :] - points[..., _WRIST, :]
    across = points[..., _INDEX, :] - points[..., _RING, :]
    out = np.cross(across, along) if side == "right" else np.cross(along, across)
    flat = np.linalg.norm(out, axis=-1, keepdims=True) < _LEAST
    out = np.where(flat, np.nan, out)
    fingers, palmar = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (along, out))
    return np.stack([fingers, palmar, np.cross(fingers, palmar)], axis=-1)


def in_palm(
    keypoints: Float[np.ndarray, "*b 21 3"],
    side: str,
    fingers: Float[np.ndarray, "3"],
    palmar: Float[np.ndarray, "3"],
) -> Float[np.ndarray, "*b 21 3"]:
    """Keypoints relative to the wrist (m), turned so that the person's palm lies as the robot's does.

    Args:
        keypoints: m, in any frame.
        side: the person's hand.
        fingers, palmar: unit vectors at right angles in the robot's frame: where its fingers point and out of its palm.

    Raises:
        InputError: unknown side.
    """
    robot = np.stack([fingers, palmar, np.cross(fingers, palmar)], axis=-1)
    turn = robot @ np.swapaxes(palm_axes(keypoints, side), -1, -2)
    relative = np.asarray(keypoints, float) - np.asarray(keypoints, float)[..., _WRIST : _WRIST + 1, :]
    return np.einsum("...ij,...kj->...ki", turn, relative)
