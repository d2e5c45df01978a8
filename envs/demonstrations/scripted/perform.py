"""Performing scripted grasps in the physics engine, and keeping those that a person could have done."""

import dataclasses
from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int
from mujoco import batch
from scipy.spatial.transform import Rotation

from envs.scene import NUM_WRIST

# What can come of a script; the first is success.
OUTCOMES = ("held", "diverged", "not lifted", "slipped", "turned in the hand")
_RISE = 0.06  # m the object must rise
SLIP, SLIP_TURN = 0.01, np.deg2rad(15.0)  # how far it may move in the hand after the lift


@dataclasses.dataclass(frozen=True)
class Performance:
    """What the engine made of a batch of scripts; n performances of t physics steps, metres, radians, wxyz.

    Attributes:
        angles: achieved hinge angles.
        wrist_position, wrist_rotation: achieved wrist pose (world_from_hand as a matrix).
        object_pose: position and quaternion.
        outcome: index into `OUTCOMES` of the first thing that went wrong: the engine found a bad number; the object is
            not lifted at the end; or it moved or turned in the hand between the lift's end and the last frame.
    """

    angles: Float[np.ndarray, "n t j"]
    wrist_position: Float[np.ndarray, "n t 3"]
    wrist_rotation: Float[np.ndarray, "n t 3 3"]
    object_pose: Float[np.ndarray, "n t 7"]
    outcome: Int[np.ndarray, "n"]

    @property
    def held(self) -> Bool[np.ndarray, "n"]:
        return self.outcome == OUTCOMES.index("held")


def perform(
    models: Sequence[mujoco.MjModel],
    bases: Float[np.ndarray, "n 3 3"],
    controls: Float[np.ndarray, "n t u"],
    object_start: Float[np.ndarray, "n 7"],
    lifted_at: Float[np.ndarray, "n"],
) -> Performance:
    """Run each model under its controls, one row per physics step, from its first control's pose.

    Args:
        models: scenes (`envs.scene.scene_spec`) on the engine's settings.
        bases: world_from_base of each scene's wrist.
        controls: targets of the wrist's six joints and the hinges.
        object_start: where each object stands.
        lifted_at: time (s) at which each lift ends.
    """
    qpos, diverged = roll_out(models, controls, object_start)
    return judge(qpos, diverged, bases, np.round(lifted_at / models[0].opt.timestep).astype(int))


def roll_out(
    models: Sequence[mujoco.MjModel], controls: Float[np.ndarray, "n t u"], object_start: Float[np.ndarray, "n 7"]
) -> tuple[Float[np.ndarray, "n t q"], Bool[np.ndarray, "n"]]:
    """qpos after each physics step, and in which worlds the engine found a bad number; arguments as of `perform`."""
    count, steps = controls.shape[:2]
    worlds = batch.Batch(models[0], nsim=count)
    worlds.set_models(models)
    worlds.bind("qpos")[:] = np.concatenate([controls[:, 0], object_start], axis=1)
    qpos = worlds.rollout(steps, control=controls, record=("qpos",))["qpos"]
    return qpos, worlds.warning[:, :, 1].any(axis=1)


def judge(
    qpos: Float[np.ndarray, "n t q"],
    diverged: Bool[np.ndarray, "n"],
    bases: Float[np.ndarray, "n 3 3"],
    lifted: Int[np.ndarray, "n"],
) -> Performance:
    """What performances came to, of which the lifts end at the steps `lifted`; other arguments as of `roll_out`."""
    count, steps = qpos.shape[:2]
    turns = Rotation.from_euler("XYZ", qpos[..., 3:NUM_WRIST].reshape(-1, 3)).as_matrix().reshape(count, steps, 3, 3)
    rotation = bases[:, None] @ turns
    position = np.einsum("nij,ntj->nti", bases, qpos[..., :3])
    pose = qpos[..., -7:]
    return Performance(
        angles=qpos[..., NUM_WRIST:-7],
        wrist_position=position,
        wrist_rotation=rotation,
        object_pose=pose,
        outcome=_outcomes(rotation, position, pose, lifted, diverged),
    )


def _outcomes(
    rotation: Float[np.ndarray, "n t 3 3"],
    position: Float[np.ndarray, "n t 3"],
    pose: Float[np.ndarray, "n t 7"],
    lifted: Int[np.ndarray, "n"],
    diverged: Bool[np.ndarray, "n"],
) -> Int[np.ndarray, "n"]:
    """See `Performance.outcome`; `lifted` are the steps at which the lifts end."""
    rows = np.arange(len(pose))
    rose = pose[:, -1, 2] - pose[:, 0, 2] > _RISE
    in_hand = np.einsum("ntji,ntj->nti", rotation, pose[..., :3] - position)
    slip = np.linalg.norm(in_hand[:, -1] - in_hand[rows, lifted], axis=-1)

    def orientation(index: np.ndarray) -> Rotation:
        quaternion = Rotation.from_quat(pose[rows, index, 3:], scalar_first=True)
        return Rotation.from_matrix(rotation[rows, index]).inv() * quaternion

    turn = (orientation(lifted).inv() * orientation(np.full(len(pose), pose.shape[1] - 1))).magnitude()
    wrong = np.stack([diverged, ~rose, slip >= SLIP, turn >= SLIP_TURN], axis=1)
    return np.where(wrong.any(axis=1), 1 + np.argmax(wrong, axis=1), 0)
