"""Keypoints as seen from the palm, in the directions of a robot hand's own frame."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mjx_hand.capture.keypoints.layouts import KEYPOINTS, PALM
from mjx_hand.errors import InputError

_WRIST, _INDEX, _MIDDLE, _RING = (KEYPOINTS.index(k) for k in ("wrist", "index_mcp", "middle_mcp", "ring_mcp"))
_NEEDED = (_WRIST, _INDEX, _MIDDLE, _RING)
_LEAST = 1e-6  # m^2; of the palm's triangle, below which it has no direction
_SPREAD = 5e-3  # m; points of the palm nearer to a line than this are in line


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

    Where the wrist or one of the three knuckles is missing, the others of the palm say where it is.

    Args:
        keypoints: m, in any frame.
        side: the person's hand.
        fingers, palmar: unit vectors at right angles in the robot's frame: where its fingers point and out of its palm.

    Raises:
        InputError: unknown side.
    """
    robot = np.stack([fingers, palmar, np.cross(fingers, palmar)], axis=-1)
    given = np.asarray(keypoints, float)
    whole = _with_palm_filled(given, side) if given.ndim > 2 else given
    turn = robot @ np.swapaxes(palm_axes(whole, side), -1, -2)
    wrist = whole[..., _WRIST : _WRIST + 1, :]
    relative = np.concatenate([wrist, given[..., 1:, :]], axis=-2) - wrist
    return np.einsum("...ij,...kj->...ki", turn, relative)


def _with_palm_filled(keypoints: Float[np.ndarray, "*b t 21 3"], side: str) -> Float[np.ndarray, "*b t 21 3"]:
    """The wrist and the knuckles that give the palm's axes also in frames that show only three others of the palm.

    The palm is as rigid as it is known: each point is at its median place in the palm's axes.
    """
    flat = np.array(keypoints, float).reshape(-1, *keypoints.shape[-3:])
    for points in flat:
        palm = points[:, PALM]
        seen = np.isfinite(palm).all(axis=-1)
        lacking = ~np.isfinite(points[:, list(_NEEDED)]).all(axis=(1, 2))
        axes = palm_axes(points, side)
        known = np.isfinite(axes).all(axis=(1, 2))
        repairable = np.flatnonzero(lacking & (seen.sum(axis=1) >= 3))
        if not known.any() or not len(repairable):
            continue
        local = np.einsum("tji,tkj->tki", axes[known], palm[known] - points[known, _WRIST : _WRIST + 1])
        often = np.isfinite(local).all(axis=-1).any(axis=0)
        places = np.full((len(PALM), 3), np.nan)
        places[often] = np.nanmedian(local[:, often], axis=0)
        for frame in repairable:
            shared = seen[frame] & often
            model, found = places[shared], palm[frame, shared]
            if np.linalg.matrix_rank(model - model.mean(axis=0), tol=_SPREAD) < 2:
                continue  # in line: nothing says how the palm is turned about it
            turn = Rotation.align_vectors(found - found.mean(axis=0), model - model.mean(axis=0))[0]
            for k in (k for k in _NEEDED if not np.isfinite(points[frame, k]).all()):
                points[frame, k] = turn.apply(places[PALM.index(k)] - model.mean(axis=0)) + found.mean(axis=0)
    return flat.reshape(keypoints.shape)
