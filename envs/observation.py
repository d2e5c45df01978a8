"""The policy's observation, from qpos, qvel and sensors alone; `mjx_hand.player.features` says what it holds."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from envs.commands import followed_target
from envs.physics.engine import PhysicsState
from envs.reference import Reference
from envs.scene import NUM_WRIST
from envs.task import Task
from mjx_hand.bodies.body import Body
from mjx_hand.objects.description import OBJECT_KINDS
from mjx_hand.player.features import (
    CONTACT_FORCES,
    LIVE_ONLY,
    OBSERVATION_LIMIT,
    Feature,
    feature_table,
    offsets_and_scales,
)
from mjx_hand.player.observed_state import HUMAN_NAMES, HandNames, ObservedState
from mjx_hand.rotations import axis_angle_matrix, quaternion_difference, quaternion_to_matrix

_PROPERTIES = ("object_mass", "object_friction")  # what no camera sees


def wrist_rotation(turns: Float[Array, "3"], base: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """world_from_hand for the wrist's three turns (rad), R = base Rx Ry Rz."""
    x, y, z = (axis_angle_matrix(jnp.eye(3)[k], turns[k]) for k in range(3))
    return base @ x @ y @ z


def residual_scale(task: Task, hand: HandNames = HUMAN_NAMES, reach: float = 1.0) -> Float[np.ndarray, "u"]:
    """What a residual of 1 is worth for each target (m, rad), of a hand with this `Body.reach`."""
    return np.concatenate(
        [
            np.full(3, 0.0 if task.live else task.residual_scale_wrist_position),
            np.full(3, 0.0 if task.live else task.residual_scale_wrist_rotation),
            np.full(len(hand.joints), reach * task.residual_scale_fingers),
        ]
    )


def observed_features(task: Task, hand: HandNames = HUMAN_NAMES, reach: float = 1.0) -> tuple[Feature, ...]:
    """What a policy of this task and hand sees, in order."""
    table = feature_table(residual_scale(task, hand, reach), task.lookahead, OBJECT_KINDS, hand)
    unseen = {name for name in _PROPERTIES if not task.observe_properties}
    unseen |= {CONTACT_FORCES} if not task.observe_forces else set()
    unseen |= {f.name for f in table if f.of_demonstration} if task.live else LIVE_ONLY
    return tuple(feature for feature in table if feature.name not in unseen)


def observe(
    reference: Reference,
    task: Task,
    body: Body,
    demonstration: Int[Array, ""],
    frame: Int[Array, ""],
    physics: PhysicsState,
    residual: Float[Array, "u"],
    displacement: Float[Array, "3"] | None = None,
    commanded: Float[Array, "u"] | None = None,
) -> Float[Array, "o"]:
    """The observation at `frame` of a demonstration; `displacement` is where the wrist's path goes with the object, and
    `commanded` what a teleoperated hand was told, which it sees in place of the demonstrated coordinates."""
    seen = _seen(reference, task, body, demonstration, frame, physics, residual, displacement, commanded)
    table = observed_features(task, body.names, body.reach)
    offset, scale = offsets_and_scales(table)
    features = jnp.concatenate([feature.value(seen).ravel() for feature in table])
    return jnp.clip((features - offset) * scale, -OBSERVATION_LIMIT, OBSERVATION_LIMIT)


def _seen(
    reference: Reference,
    task: Task,
    body: Body,
    demonstration: Int[Array, ""],
    frame: Int[Array, ""],
    physics: PhysicsState,
    residual: Float[Array, "u"],
    displacement: Float[Array, "3"] | None,
    commanded: Float[Array, "u"] | None,
) -> ObservedState:
    base, length = reference.base[demonstration], reference.length[demonstration]
    poses = reference.object_pose[demonstration]
    later = jnp.minimum(frame + jnp.array(task.lookahead), length - 1)
    frames = jnp.concatenate([frame[None], later])
    targets = reference.targets[demonstration, frames]
    targets = targets if commanded is None else targets.at[0].set(commanded)
    if displacement is not None:
        targets = targets + jax.vmap(lambda k: followed_target(reference, demonstration, k, displacement))(frames)
    hand, first = body.of_targets(physics.qpos), body.num_coordinates
    object_pose = physics.qpos[first:]
    return ObservedState(
        hand=hand,
        hand_speed=body.of_targets(physics.qvel),
        residual=residual,
        object_pose=object_pose,
        object_speed=physics.qvel[first:],
        object_turn=quaternion_difference(poses[frame, 3:], object_pose[3:]),
        object_axes=quaternion_to_matrix(object_pose[3:]),
        wrist_place=base @ hand[:3],
        wrist_axes=wrist_rotation(hand[3:NUM_WRIST], base),
        tips=physics.sensordata.reshape(-1, 3),
        forces=physics.contact[:, :3],
        base=base,
        target=targets[0],
        grip=reference.grip[demonstration, frame],
        pose=poses[frame],
        first_pose=poses[0],
        targets_ahead=targets[1:],
        poses_ahead=poses[later],
        phase=(frame / length)[None],
        object_features=reference.features[demonstration],
    )
