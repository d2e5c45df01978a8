"""UmeTrack's hand (Han et al., SIGGRAPH Asia 2022, https://arxiv.org/abs/2211.00099): joint angles to 21 keypoints.

A user's profile (`hand_model`, as HOT3D ships it) is a left hand in millimetres, fingers along +x, the back of the hand
along +y, the thumb at +z: 20 hinges, four a finger from the thumb on, each an axis and a point of the rest pose; and 21
landmarks, each carried by up to three of 17 bones. Bones 0 and 1 are the wrist's, then come three a finger: after its
second, third and fourth hinge. A right hand is its mirror image. Conventions: HOT3D's own loader,
https://github.com/facebookresearch/hot3d (hot3d/data_loaders/umetrack_layer.py, UmeTrackHandDataProvider.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from mjx_hand.capture.keypoints.layouts import NUM_KEYPOINTS
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers

Array = np.ndarray
NUM_ANGLES, NUM_BONES = 20, 17
_LAYOUT: dict[str, tuple[int | str, ...]] = {
    "joint_rotation_axes": (22, 3),
    "joint_rest_positions": (22, 3),
    "landmark_rest_positions": (21, 3),
    "landmark_rest_bone_indices": (21, "k"),
    "landmark_rest_bone_weights": (21, "k"),
    "joint_limits": (22, 2),
}
# The landmark of each of the 21 keypoints; the thumb's base joint is none.
_LANDMARKS = (5, -1, 6, 7, 0, 8, 9, 10, 1, 11, 12, 13, 2, 14, 15, 16, 3, 17, 18, 19, 4)
_BASE = 1  # that keypoint
_GRID, _GRID_SHARE = 7, 0.1  # angles of each of the thumb's first hinges; their say beside the recording's frames
_REACH = 0.03  # m that the thumb's base may be from its first hinge


@dataclass(frozen=True)
class UmeTrackHand:
    """A user's hand at rest; metres, a left hand.

    Attributes:
        axes, points: of the 20 hinges.
        limits: of their angles, rad.
        landmarks: at rest.
        weights: how much each landmark follows each bone.
    """

    axes: Float[Array, "20 3"]
    points: Float[Array, "20 3"]
    limits: Float[Array, "20 2"]
    landmarks: Float[Array, "21 3"]
    weights: Float[Array, "21 17"]


def umetrack_hand(path: Path, profile: Mapping[str, Any]) -> UmeTrackHand:
    """The hand of a profile.

    Args:
        path: for messages.
        profile: the `hand_model` of the file.

    Raises:
        InputError: it lacks something, or is not sound.
    """
    try:
        found = {name: np.asarray(profile[name], float) for name in _LAYOUT if name in profile}
    except (TypeError, ValueError):
        raise InputError(f"{path}: its hand_model has lists that are no tables of numbers; get it again") from None
    n = numbers(path, found, _LAYOUT)
    bones: Int[Array, "21 k"] = n["landmark_rest_bone_indices"].astype(int)
    if bones.min() < 0 or bones.max() >= NUM_BONES:
        raise InputError(f"{path}: a landmark follows bone {bones.max()}; a hand_model has {NUM_BONES}")
    weights = np.zeros((len(bones), NUM_BONES))
    for k in range(bones.shape[1]):
        share = n["landmark_rest_bone_weights"][:, k]
        weights[np.arange(len(bones)), bones[:, k]] = np.where(
            share != 0, share, weights[np.arange(len(bones)), bones[:, k]]
        )
    return UmeTrackHand(
        axes=n["joint_rotation_axes"][:NUM_ANGLES],
        points=n["joint_rest_positions"][:NUM_ANGLES] / 1e3,
        limits=n["joint_limits"][:NUM_ANGLES],
        landmarks=n["landmark_rest_positions"] / 1e3,
        weights=weights,
    )


def landmarks(hand: UmeTrackHand, angles: Float[Array, "t 20"]) -> Float[Array, "t 21 3"]:
    """The landmarks (m) in the frame of the left hand's wrist, for joint angles (rad)."""
    frames = len(angles)
    turn = np.tile(np.eye(3), (frames, NUM_BONES, 1, 1))
    place = np.zeros((frames, NUM_BONES, 3))
    for finger in range(5):
        turned, moved = np.tile(np.eye(3), (frames, 1, 1)), np.zeros((frames, 3))
        for k in range(4):
            hinge = 4 * finger + k
            own = Rotation.from_rotvec(angles[:, hinge, None] * hand.axes[hinge]).as_matrix()
            moved = moved + np.einsum("tij,tj->ti", turned, hand.points[hinge] - own @ hand.points[hinge])
            turned = turned @ own
            if k > 0:
                turn[:, 1 + 3 * finger + k], place[:, 1 + 3 * finger + k] = turned, moved
    by_bone = np.einsum("tbij,lj->tlbi", turn, hand.landmarks) + place[:, None]
    return np.einsum("lb,tlbi->tli", hand.weights, by_bone)


def umetrack_keypoints(
    hand: UmeTrackHand,
    angles: Float[Array, "t 20"],
    wrist_rotation: Float[Array, "t 3 3"],
    wrist_position: Float[Array, "t 3"],
    side: str,
) -> Float[Array, "t 21 3"]:
    """The 21 keypoints (m) in the frame of the wrist's pose.

    Twenty are landmarks. The thumb's base joint is no landmark: its two hinges do not meet in a point, and the one from
    which the next joint is most nearly at one distance stands for it.

    Args:
        hand: the user's.
        angles: of the 20 hinges, rad.
        wrist_rotation, wrist_position: of each frame.
        side: "right" or "left".
    """
    in_wrist = landmarks(hand, angles)
    found = np.zeros((len(angles), NUM_KEYPOINTS, 3))
    found[:] = in_wrist[:, list(_LANDMARKS)]
    found[:, _BASE] = _thumb_base(hand, in_wrist[:, _LANDMARKS[_BASE + 1]])
    if side == "right":
        found[..., 0] *= -1
    return np.einsum("tij,tkj->tki", wrist_rotation, found) + wrist_position[:, None]


def _thumb_base(hand: UmeTrackHand, next_joint: Float[Array, "t 3"]) -> Float[Array, "3"]:
    """The centre of the sphere on which the thumb's second joint moves, in this recording and through its range."""
    range_ = [np.linspace(low, high, _GRID) for low, high in hand.limits[:2]]
    angles = np.zeros((_GRID**2, NUM_ANGLES))
    angles[:, :2] = np.stack(np.meshgrid(*range_), axis=-1).reshape(-1, 2)
    possible = landmarks(hand, angles)[:, _LANDMARKS[_BASE + 1]]
    places = np.concatenate([next_joint, possible])
    weight = np.concatenate(
        [np.full(len(next_joint), 1 / np.sqrt(len(next_joint))), np.full(len(possible), _GRID_SHARE / _GRID)]
    )

    def off(x: Float[Array, "4"]) -> Float[Array, "n"]:
        return 1e3 * weight * (np.linalg.norm(places - x[:3], axis=1) - x[3])

    start = np.append(hand.points[0], np.linalg.norm(places - hand.points[0], axis=1).mean())
    # Hinges that are nearly parallel move the joint on an arc, of which any far point is a centre: it stays near them.
    return least_squares(off, start, bounds=(start - _REACH, start + _REACH)).x[:3]
