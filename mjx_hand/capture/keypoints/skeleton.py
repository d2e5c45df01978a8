"""A hand's bones at rest, as keypoints see them: straight lines from joint to joint."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.layouts import LINK_KEYPOINTS, NUM_KEYPOINTS, TIP_KEYPOINTS
from mjx_hand.hand.joints import PARENTS, TIP_LINKS
from mjx_hand.hand.model import HandModel
from mjx_hand.rigid.axes import anatomical_axes

# The two ends of each finger's three bones, as keypoints: fingers in MANO's order, from the knuckle outwards.
BONES = np.array(
    [[(LINK_KEYPOINTS[link - 2 + k], LINK_KEYPOINTS[link - 1 + k] if k < 2 else tip) for k in range(3)]
     for link, tip in zip(TIP_LINKS, TIP_KEYPOINTS, strict=True)]
)  # fmt: skip


@dataclass(frozen=True)
class Skeleton:
    """The rest pose of one hand; metres, directions of the hand frame, fingers in MANO's order.

    Attributes:
        keypoints: the 21 keypoints at rest, relative to the wrist joint.
        directions: unit vectors along the three bones of each finger, knuckle outwards.
        flexion: unit axis about which each bone's first joint bends; positive closes the hand.
    """

    keypoints: Float[np.ndarray, "21 3"]
    directions: Float[np.ndarray, "5 3 3"]
    flexion: Float[np.ndarray, "5 3 3"]

    @property
    def link_offset(self) -> Float[np.ndarray, "16 3"]:
        """Each joint's centre relative to its parent's, in the order of `LINKS`; the wrist's is zero."""
        joints = self.keypoints[list(LINK_KEYPOINTS)]
        return joints - joints[[0, *PARENTS[1:]]]

    @property
    def tip_offset(self) -> Float[np.ndarray, "5 3"]:
        """Each finger tip relative to its last joint's centre."""
        return self.keypoints[BONES[:, 2, 1]] - self.keypoints[BONES[:, 2, 0]]


def rest_keypoints(hand: HandModel) -> tuple[Float[np.ndarray, "21 3"], Float[np.ndarray, "21 3 s"]]:
    """The keypoints (m, hand frame) of the mean shape, and their displacement per unit of each shape coefficient."""
    regressor = np.asarray(hand.joint_regressor, np.float64)
    template, shapedirs = np.asarray(hand.template, np.float64), np.asarray(hand.shapedirs, np.float64)
    joints, tips = list(LINK_KEYPOINTS), list(TIP_KEYPOINTS)
    mean = np.empty((NUM_KEYPOINTS, 3))
    change = np.empty((NUM_KEYPOINTS, 3, hand.num_shape))
    mean[joints], change[joints] = regressor @ template, np.einsum("jv,vcs->jcs", regressor, shapedirs)
    mean[tips], change[tips] = template[hand.tip_vertices], shapedirs[hand.tip_vertices]
    return mean, change


def skeleton(hand: HandModel, shape: Float[np.ndarray, "s"]) -> Skeleton:
    """The skeleton of `hand` for shape coefficients."""
    mean, change = rest_keypoints(hand)
    return _skeleton(mean + change[..., : len(shape)] @ shape, hand.side)


def own_skeleton(
    mean: Skeleton, side: str, lengths: Float[np.ndarray, "5 3"], bases: Float[np.ndarray, "5 3"]
) -> Skeleton:
    """`mean` with a person's own bones, in the directions of the mean's.

    Args:
        mean: the mean shape's skeleton.
        side: "right" or "left".
        lengths: of the three bones of each finger, m.
        bases: where each finger begins, relative to the wrist joint in hand axes, m.
    """
    keypoints = mean.keypoints.copy()
    keypoints[BONES[:, 0, 0]] = bases
    for k in range(3):
        keypoints[BONES[:, k, 1]] = keypoints[BONES[:, k, 0]] + lengths[:, k, None] * mean.directions[:, k]
    return _skeleton(keypoints, side)


def bone_directions(keypoints: Float[np.ndarray, "*b 21 3"]) -> Float[np.ndarray, "*b 5 3 3"]:
    """Unit vectors along each finger's three bones; NaN where an end is missing."""
    bones = keypoints[..., BONES[..., 1], :] - keypoints[..., BONES[..., 0], :]
    with np.errstate(invalid="ignore"):
        return bones / np.linalg.norm(bones, axis=-1, keepdims=True)


def posed_keypoints(
    rest: Skeleton,
    rotations: Float[np.ndarray, "t 15 3 3"],
    wrist_rotation: Float[np.ndarray, "t 3 3"],
    wrist_position: Float[np.ndarray, "t 3"],
) -> Float[np.ndarray, "t 21 3"]:
    """The keypoints (m, the recording's frame) of a hand of this skeleton."""
    bones = rest.keypoints[BONES[..., 1]] - rest.keypoints[BONES[..., 0]]
    out = wrist_position[:, None] + np.einsum("tij,kj->tki", wrist_rotation, rest.keypoints)
    turn = wrist_rotation[:, None]
    for k in range(3):
        turn = turn @ rotations.reshape(-1, 5, 3, 3, 3)[:, :, k]
        out[:, BONES[:, k, 1]] = out[:, BONES[:, k, 0]] + np.einsum("tfij,fj->tfi", turn, bones[:, k])
    return out


def _skeleton(keypoints: Float[np.ndarray, "21 3"], side: str) -> Skeleton:
    axes = anatomical_axes(keypoints[list(LINK_KEYPOINTS)], side).reshape(5, 4, 3)
    return Skeleton(keypoints=keypoints - keypoints[0], directions=bone_directions(keypoints), flexion=axes[:, 1:])
