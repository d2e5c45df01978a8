"""Joint rotations from bone directions, with the roll about each bone that anatomy gives it.

A bone's direction leaves its rotation about itself open. Three rules close it:

1. Every joint bends first about its flexion axis and then sideways about the axis at right angles to it that the bone
   carries along, without rolling: a universal joint in the anatomical order. Unlike the shortest rotation it does not
   roll a finger that is bent and spread at once, and unlike abduction first it has no pole where a knuckle is bent
   by 90 degrees.
2. The joints further out are hinges. Where they are bent, their bones lie in the finger's plane, which shows the roll
   of the base joint; the sharper the bend, the more is known.
3. Where they are straight nothing shows it, and the base joint is taken not to roll.

Rules 2 and 3 are one least-squares estimate of the base joint's roll: sideways deviations of the outer bones against
the roll itself, each in units of its standard deviation in `pose_prior`. What is left of the deviations becomes
sideways tilt of the outer joints, so that bone directions are reproduced exactly.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mjx_hand.capture.keypoints.skeleton import Skeleton
from mjx_hand.capture.pose.pose_prior import FINGER, THUMB
from mjx_hand.hand.joints import FINGERS

Array = np.ndarray

# How far (rad) a measured bone points beside the true one: tracked keypoints err by some millimetres.
DIRECTION_DEVIATION = np.deg2rad(4.0)
ROLL_STEPS = 3  # Gauss-Newton steps; the sines are nearly straight over the roll that a joint has
_PRIOR = np.deg2rad([THUMB if finger == "thumb" else FINGER for finger in FINGERS])  # (5, 3, 4)
ROLL_DEVIATION = _PRIOR[:, 0, 3]
TILT_DEVIATION = np.hypot(_PRIOR[:, 1:, 2], DIRECTION_DEVIATION)


def joint_rotations_along(
    directions: Float[Array, "*b 5 3 3"], wrist_rotation: Float[Array, "*b 3 3"], skeleton: Skeleton
) -> Float[Array, "*b 15 3 3"]:
    """The 15 joints' rotations (MANO's order, about the flat hand) that point every bone as observed.

    Args:
        directions: unit vectors along each finger's three bones in the recording's frame, finite.
        wrist_rotation: recording-from-hand rotations.
        skeleton: the hand's bones at rest.
    """
    in_hand = np.einsum("...ji,...fkj->...fki", wrist_rotation, directions)
    rest, axes = skeleton.directions, skeleton.flexion
    base = universal_joint(rest[:, 0], axes[:, 0], in_hand[..., 0, :])
    links = [roll(base, in_hand, skeleton)]
    joints = [links[0]]
    for k in (1, 2):
        local = np.einsum("...ji,...j->...i", links[-1], in_hand[..., k, :])
        joints.append(universal_joint(rest[:, k], axes[:, k], local))
        links.append(links[-1] @ joints[-1])
    return np.stack(joints, axis=-3).reshape(*directions.shape[:-3], 15, 3, 3)


def universal_joint(
    rest: Float[Array, "f 3"], flexion: Float[Array, "f 3"], observed: Float[Array, "*b f 3"]
) -> Float[Array, "*b f 3 3"]:
    """Rotations that take `rest` to `observed`: about `flexion` first, then the shortest way, which does not roll."""
    beside = np.cross(flexion, rest)
    across = rest - (rest * flexion).sum(axis=-1, keepdims=True) * flexion
    angle = np.arctan2((observed * beside).sum(axis=-1), (observed * across).sum(axis=-1))
    bent = _turn(np.broadcast_to(flexion, observed.shape), angle)
    return _shortest(np.einsum("...ij,...j->...i", bent, rest), observed) @ bent


def roll(
    base: Float[Array, "*b 5 3 3"], directions: Float[Array, "*b 5 3 3"], skeleton: Skeleton
) -> Float[Array, "*b 5 3 3"]:
    """The base joints' rotations, rolled about their bones until the outer bones lie in the fingers' planes.

    Args:
        base: without roll.
        directions: of each finger's three bones, hand frame.
        skeleton: the hand's bones at rest.
    """
    bone, outer = directions[..., 0, :], directions[..., 1:, :]
    rest = (skeleton.directions * skeleton.flexion).sum(axis=-1)[:, 1:]  # sideways at rest: what is straight
    angle = np.zeros(base.shape[:-2])
    for _ in range(ROLL_STEPS):
        axes = np.einsum("...ij,...kj->...ki", _turn(bone, angle) @ base, skeleton.flexion[:, 1:])
        sideways = (axes * outer).sum(axis=-1) - rest
        slope = (np.cross(bone[..., None, :], axes) * outer).sum(axis=-1)
        pull = (slope * sideways / TILT_DEVIATION**2).sum(axis=-1) + angle / ROLL_DEVIATION**2
        stiffness = ((slope / TILT_DEVIATION) ** 2).sum(axis=-1) + 1 / ROLL_DEVIATION**2
        angle = angle - pull / stiffness
    return _turn(bone, angle) @ base


def _turn(axis: Float[Array, "*b 3"], angle: Float[Array, "*b"]) -> Float[Array, "*b 3 3"]:
    return Rotation.from_rotvec((axis * angle[..., None]).reshape(-1, 3)).as_matrix().reshape(*axis.shape, 3)


def _shortest(start: Float[Array, "*b 3"], end: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """The shortest rotation from one unit vector to another."""
    axis = np.cross(start, end)
    sine = np.linalg.norm(axis, axis=-1)
    angle = np.arctan2(sine, (start * end).sum(axis=-1))
    return _turn(axis / np.maximum(sine, 1e-12)[..., None], angle)
