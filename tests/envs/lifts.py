"""Rollouts made by hand: a lift that is followed to the letter, and ways to depart from it."""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from envs.evaluation.rollout import Rollouts
from mjx_hand.objects.description import ObjectDescription

FPS = 50.0
CUBE = ObjectDescription(kind="box", size=np.array([0.02, 0.02, 0.02]), mass=0.1, friction=0.9)


def lift(frames: int = 40, held: int = 0, rows: int = 1) -> Rollouts:
    """Rollouts that follow a 10 cm lift to the letter, and hold on for `held` frames."""
    total = frames + held
    pose = np.zeros((rows, total, 7))
    pose[..., 3] = 1.0
    pose[..., 2] = np.minimum(np.arange(total) / (frames / 2), 1.0) * 0.1
    hand = np.random.default_rng(0).normal(scale=0.05, size=(16, 3)) + pose[:, :, None, :3]
    tips = np.random.default_rng(1).normal(scale=0.05, size=(5, 3)) + pose[:, :, None, :3]
    counted = np.arange(total) < frames
    return Rollouts(
        demonstration=np.zeros(rows, int),
        qpos=np.zeros((rows, total, 33)),
        object_pose=pose,
        object_reference=pose.copy(),
        joints=hand,
        joints_reference=hand.copy(),
        tips=tips,
        tips_reference=tips.copy(),
        contact=np.zeros((rows, total, 16, 6)),
        least_force=np.ones(rows),
        counted=np.tile(counted, (rows, 1)),
        held=np.tile(~counted, (rows, 1)),
        reward=np.zeros((rows, total)),
        fps=FPS,
    )


def turned(pose: np.ndarray, angle: float | np.ndarray) -> np.ndarray:
    """Poses turned by an angle (rad) about a slanting axis."""
    axis = np.array([1.0, 2.0, -2.0]) / 3
    turn = Rotation.from_rotvec(np.broadcast_to(angle, pose.shape[:-1])[..., None] * axis)
    quaternion = (turn * Rotation.from_quat(pose[..., 3:], scalar_first=True)).as_quat(scalar_first=True)
    return np.concatenate([pose[..., :3], quaternion], axis=-1)


def moved(rollouts: Rollouts, by: float | np.ndarray = 0.0, angle: float | np.ndarray = 0.0) -> Rollouts:
    """With the object moved sideways by a distance (m) and turned by an angle (rad) in all frames or each."""
    pose = turned(rollouts.object_pose, angle)
    pose[..., 0] += by
    return dataclasses.replace(rollouts, object_pose=pose)


def carried(slip: float, frames: int = 250) -> Rollouts:
    """A lift, then a hand that wanders and turns with the object, which slips in it by so much over the frames."""
    rollouts = lift(held=frames)
    after = np.clip(np.arange(40 + frames) - 39, 0, None) / frames
    turn = Rotation.from_rotvec(after[:, None] * [0.3, 1.0, -0.4])
    centre = rollouts.object_pose[0, :, :3]
    joints = np.stack([turn.apply(rollouts.joints[0, :, k] - centre) + centre for k in range(16)], axis=1)
    pose = rollouts.object_pose.copy()
    pose[0, :, :3] += turn.apply(slip * after[:, None] * [0.0, 0.0, 1.0])
    pose[0, :, :2] += 0.2 * after[:, None]
    joints[..., :2] += 0.2 * after[:, None, None]
    return dataclasses.replace(rollouts, object_pose=pose, joints=joints[None])
