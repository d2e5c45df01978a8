"""A rollout as a scene for the browser viewer: demonstration, twin, object, and how far the twin is from it."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.evaluation.contact_arrows import contact_arrows
from envs.evaluation.metrics import grip_force, position_error, rotation_error
from envs.evaluation.rollout import Rollouts
from envs.scene import NUM_WRIST, base_rotation
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Demonstration, JointMotion
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.pytree import replace
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.view.browser.hand_scene import object_layers, skin_layer, skinned_motion, transforms, twin_layer
from mjx_hand.view.browser.scene import Colour, Curve, MeshLayer, PointLayer, Scene, SkinLayer

_GHOST: Colour = (150, 150, 150)
_FAINT = 0.35
_FORCE: Colour = (25, 90, 230)


def rollout_scene(demonstration: Demonstration, rollouts: Rollouts, index: int, hand: RigidHand, title: str) -> Scene:
    """Rollout `index`, with the demonstration that it followed as a grey ghost (m, world, z up).

    Args:
        demonstration: the one it followed.
        rollouts: of the policy.
        index: which of them.
        hand: the twin's, with its meshes.
        title: one line.
    """
    frames = np.flatnonzero(rollouts.counted[index])
    done = twin_motion(demonstration, rollouts, index)
    skin = skin_layer(skinned_motion(done, demonstration.shape, hand), load_hand(side=done.side), "twin, skin", False)
    shown = replace(
        demonstration,
        motion=_first(demonstration.motion, len(frames)),
        object_pose=demonstration.object_pose[: len(frames)],
    )
    wanted, *support = object_layers(shown)
    achieved = rollouts.object_pose[index, frames]
    moved = transforms(quaternion_matrices(achieved[:, 3:]), achieved[:, :3])[:, None]
    layers = (
        twin_layer(done, hand, "twin"),
        skin,
        replace(wanted, name="object", transforms=moved),
        ghost(twin_layer(shown.motion, hand, "demonstration")),
        ghost(replace(wanted, name="demonstrated object")),
        *support,
        force_layer(rollouts, index),
    )
    curves = (
        Curve("object, position error", 100 * position_error(rollouts)[index, frames], "cm"),
        Curve("object, rotation error", np.rad2deg(rotation_error(rollouts)[index, frames]), "degrees"),
        Curve("grip force", grip_force(rollouts)[index, frames], "N"),
    )
    return Scene(title=title, fps=rollouts.fps, layers=layers, curves=curves, ground=0.0)


def force_layer(rollouts: Rollouts, index: int) -> PointLayer:
    """What each link presses the object with, as lines of 5 mm/N that end where it touches, in the counted frames."""
    arrows = contact_arrows(rollouts, index, np.flatnonzero(rollouts.counted[index]))
    count = arrows.shape[1]
    lines = np.stack([np.arange(count), count + np.arange(count)], axis=1)
    points = np.concatenate([arrows[:, :, 0], arrows[:, :, 1]], axis=1)
    return PointLayer("forces on the object", points, _FORCE, radius=0.0015, lines=lines)


def twin_motion(demonstration: Demonstration, rollouts: Rollouts, index: int) -> JointMotion:
    """What the hand of rollout `index` did in the demonstration's frames."""
    return posed(demonstration, rollouts.qpos[index, rollouts.counted[index]], rollouts.fps)


def posed(demonstration: Demonstration, qpos: Float[np.ndarray, "t q"], fps: float) -> JointMotion:
    """The motion of a hand in these coordinates of a demonstration's scene."""
    base = base_rotation(demonstration)
    turned = Rotation.from_matrix(base) * Rotation.from_euler("XYZ", qpos[:, 3:NUM_WRIST])
    return JointMotion(
        fps=fps,
        angles=qpos[:, NUM_WRIST : NUM_WRIST + demonstration.motion.angles.shape[1]],
        wrist_position=qpos[:, :3] @ base.T,
        wrist_quaternion=turned.as_quat(scalar_first=True),
        valid=np.ones(len(qpos), bool),
        side=demonstration.motion.side,
        source="twin",
    )


def ghost(layer: MeshLayer | SkinLayer) -> MeshLayer | SkinLayer:
    """The layer, grey and faint."""
    return replace(layer, colour=_GHOST, opacity=_FAINT)


def _first(motion: JointMotion, frames: int) -> JointMotion:
    """Its first frames."""
    return replace(
        motion,
        angles=motion.angles[:frames],
        wrist_position=motion.wrist_position[:frames],
        wrist_quaternion=motion.wrist_quaternion[:frames],
        valid=motion.valid[:frames],
    )
