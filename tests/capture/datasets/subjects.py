"""A made-up licensed hand, poses of it, and where MANO's formula puts its joints: the oracle of all importers.

No MANO data: the file has the official one's keys, filled from the open hand and random numbers.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.hand.joints import PARENTS
from mjx_hand.hand.mirror import mirrored
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.open_hand import load_open_hand
from mjx_hand.motion import Motion
from mjx_hand.pytree import replace
from tests.hand.mano_layout import write_npz

# Wrist, then thumb to little finger, each base to tip, by MANO's 16 joints and then its five tips (index, middle,
# pinky, ring, thumb): the order in which MANO's PyTorch layers return 21 joints.
ORDER_21 = (0, 13, 14, 15, 20, 1, 2, 3, 16, 4, 5, 6, 17, 10, 11, 12, 19, 7, 8, 9, 18)
TIPS = (3, 6, 9, 12, 15)


def licensed_hand(side: str = "right") -> HandModel:
    """The open hand moved off its place, so that its wrist is where no other hand's is."""
    hand, rng = load_open_hand("right"), np.random.default_rng(7)
    hand = replace(hand, template=hand.template + np.array([0.03, 0.02, -0.01], np.float32))
    hand = replace(hand, pose_mean=rng.normal(scale=0.3, size=(15, 3)).astype(np.float32))
    return hand if side == "right" else mirrored(hand)


def components() -> np.ndarray:
    return np.linalg.qr(np.random.default_rng(3).normal(size=(45, 45)))[0]


def licensed_file(folder: Path, side: str = "right") -> Path:
    """A left file holds the right hand's shape directions, as the official one does."""
    changes = {"hands_components": components()}
    if side == "left":
        changes["shapedirs"] = licensed_hand("right").shapedirs
    return write_npz(licensed_hand(side), folder / f"MANO_{side.upper()}.npz", **changes)


@dataclass(frozen=True)
class Take:
    """A random hand in motion: axis-angles (t, 16, 3) about the flat hand, translation (t, 3), shape (10,)."""

    pose: np.ndarray
    translation: np.ndarray
    shape: np.ndarray

    def coefficients(self, side: str, mean: bool) -> np.ndarray:
        """The fingers' pose in the made-up file's components, about its mean pose or about the flat hand."""
        fingers = self.pose[:, 1:].reshape(-1, 45)
        return (fingers - licensed_hand(side).pose_mean.reshape(45) * mean) @ np.linalg.inv(components())


def take(frames: int = 6, seed: int = 0) -> Take:
    rng = np.random.default_rng(seed)
    return Take(
        pose=rng.normal(scale=0.5, size=(frames, 16, 3)),
        translation=rng.normal(size=(frames, 3)),
        shape=rng.normal(size=10),
    )


def rest_joints(hand: HandModel, shape: np.ndarray, as_shipped: bool = True) -> np.ndarray:
    """(21, 3): MANO's 16 joints at rest and its five tips."""
    directions = np.asarray(licensed_hand("right").shapedirs if as_shipped else hand.shapedirs, float)
    rest = hand.template + directions @ shape
    return np.concatenate([hand.joint_regressor @ rest, rest[hand.tip_vertices]])


def posed_joints(rest: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """(t, 21, 3): rest joints turned by axis-angles, each link about its own joint, the wrist staying where it is."""
    turns = Rotation.from_rotvec(pose.reshape(-1, 3)).as_matrix().reshape(-1, 16, 3, 3)
    frames = []
    for turn in turns:
        links, places = [turn[0]], [rest[0]]
        for j, parent in enumerate(PARENTS[1:], start=1):
            places.append(places[parent] + links[parent] @ (rest[j] - rest[parent]))
            links.append(links[parent] @ turn[j])
        tips = [places[k] + links[k] @ (rest[16 + f] - rest[k]) for f, k in enumerate(TIPS)]
        frames.append(np.stack([*places, *tips]))
    return np.stack(frames)


def joints_of(motion: Motion) -> np.ndarray:
    """(t, 16, 3): where a motion with its own bones puts the joints, in the recording's frame."""
    assert motion.link_offset is not None
    rest = np.zeros((21, 3))
    for j, parent in enumerate(PARENTS[1:], start=1):
        rest[j] = rest[parent] + motion.link_offset[j]
    vectors = Rotation.from_matrix(motion.rotations.reshape(-1, 3, 3)).as_rotvec().reshape(-1, 15, 3)
    wrist = Rotation.from_quat(motion.wrist_quaternion, scalar_first=True).as_rotvec()[:, None]
    return posed_joints(rest, np.concatenate([wrist, vectors], axis=1))[:, :16] + motion.wrist_position[:, None]
