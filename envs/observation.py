"""What the policy sees: a vector of features scaled by hand, read from qpos, qvel and sensors alone.

Features are scaled by constants, not by running statistics: some hardly vary, and dividing by their tiny deviation
makes PPO diverge.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from envs.physics.engine import PhysicsState
from envs.reference import Reference
from envs.scene import NUM_WRIST
from envs.task import Task
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.objects.description import OBJECT_KINDS
from mjx_hand.rotations import axis_angle_matrix, quaternion_difference, quaternion_to_matrix

_NUM_TARGETS = NUM_WRIST + NUM_HINGES
# One over what each target usually varies by: wrist slides 2 cm, wrist turns and hinges 0.2 rad.
_TARGET_SCALE = np.concatenate([np.full(3, 50.0), np.full(3, 5.0), np.full(NUM_HINGES, 5.0)])
_SPEED_SCALE = np.concatenate([np.full(3, 5.0), np.full(3, 0.5), np.full(NUM_HINGES, 0.2)])
_FEATURE_SCALE = np.concatenate([[30.0, 30.0, 30.0, 5.0, 1.0], np.ones(len(OBJECT_KINDS))])
_LENGTH_SCALE = 30.0  # 1/m for errors of the object, 3 cm
OBSERVATION_LIMIT = 5.0


def wrist_rotation(turns: Float[Array, "3"], base: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """world_from_hand for the wrist's three turns (rad), R = base Rx Ry Rz."""
    x, y, z = (axis_angle_matrix(jnp.eye(3)[k], turns[k]) for k in range(3))
    return base @ x @ y @ z


def residual_scale(task: Task) -> Float[Array, "26"]:
    """What a residual of 1 is worth for each target (m, rad)."""
    return jnp.concatenate(
        [
            jnp.full(3, task.residual_scale_wrist_position),
            jnp.full(3, task.residual_scale_wrist_rotation),
            jnp.full(NUM_HINGES, task.residual_scale_fingers),
        ]
    )


def observe(
    reference: Reference,
    task: Task,
    demonstration: Int[Array, ""],
    frame: Int[Array, ""],
    physics: PhysicsState,
    residual: Float[Array, "26"],
) -> Float[Array, "o"]:
    """The observation at `frame` of a demonstration.

    Own pose against the reference, speeds, the residual so far and the grip; the object against its reference, in the
    wrist's base frame; finger tips around the object, in its own frame; targets and object some frames ahead; phase,
    and what the object is.
    """
    base = reference.base[demonstration]
    targets, poses = reference.targets[demonstration], reference.object_pose[demonstration]
    now, pose = targets[frame], poses[frame]
    hand, hand_speed = physics.qpos[:_NUM_TARGETS], physics.qvel[:_NUM_TARGETS]
    object_pose, speed = physics.qpos[_NUM_TARGETS:], physics.qvel[_NUM_TARGETS:]
    object_axes = quaternion_to_matrix(object_pose[3:])
    tips = (physics.sensordata.reshape(5, 3) - object_pose[:3]) @ object_axes
    wrist = wrist_rotation(hand[3:NUM_WRIST], base)
    in_hand = wrist.T @ (object_pose[:3] - base @ hand[:3])

    later = jnp.minimum(frame + jnp.array(task.lookahead), reference.length[demonstration] - 1)
    features = jnp.concatenate(
        [
            (hand - now) * _TARGET_SCALE,
            hand_speed * _SPEED_SCALE,
            residual / residual_scale(task),
            reference.grip[demonstration, frame, NUM_WRIST:] * 5.0,
            base.T @ (object_pose[:3] - pose[:3]) * _LENGTH_SCALE,
            quaternion_difference(pose[3:], object_pose[3:]) * 3.0,
            base.T @ speed[:3] * 3.0,
            speed[3:] * 0.2,
            (in_hand - jnp.array([-0.1, -0.05, 0.03])) * 10.0,  # about where a grasped object is
            (tips * _LENGTH_SCALE).ravel(),
            ((targets[later] - now) * _TARGET_SCALE).ravel(),
            ((poses[later, :3] - pose[:3]) @ base * _LENGTH_SCALE).ravel(),
            jnp.array([2.0 * frame / reference.length[demonstration] - 1.0, (object_pose[2] - poses[0, 2]) * 10.0]),
            reference.features[demonstration] * _FEATURE_SCALE,
        ]
    )
    return jnp.clip(features, -OBSERVATION_LIMIT, OBSERVATION_LIMIT)
