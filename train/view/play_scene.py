"""A rollout as a scene for the browser viewer: demonstration, twin, object, and how far the twin is from it."""

import numpy as np
from scipy.spatial.transform import Rotation

from envs.evaluation.contact_arrows import contact_arrows
from envs.evaluation.metrics import grip_force, position_error, rotation_error
from envs.evaluation.rollout import Rollouts
from envs.scene import NUM_WRIST, base_rotation, demonstration_spec
from envs.tracking import TrackingEnv
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Demonstration, JointMotion
from mjx_hand.pytree import replace
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.view.browser.hand_scene import SKIN, object_layers, skin_layer, skinned_motion, twin_layer
from mjx_hand.view.browser.model_layer import model_layer
from mjx_hand.view.browser.recording_scene import GLASS
from mjx_hand.view.browser.scene import Colour, Curve, MeshLayer, PointLayer, Scene, SkinLayer

_GHOST: Colour = (150, 150, 150)
_FAINT = 0.35
_FORCE: Colour = (25, 90, 230)


def rollout_scene(
    env: TrackingEnv, rollouts: Rollouts, index: int, recorded: Demonstration, person: RigidHand, title: str
) -> Scene:
    """Rollout `index`, with what the person did (m, world, z up).

    Args:
        env: that it was made in.
        rollouts: of the policy.
        index: which of them.
        recorded: what the person did in the demonstration that it followed.
        person: the hand that did.
        title: one line.
    """
    frames = np.flatnonzero(rollouts.counted[index])
    achieved, *support = object_layers(recorded, rollouts.object_pose[index, frames])
    wanted, *_ = object_layers(recorded, rollouts.object_reference[index, frames])
    layers = (
        *_hands(env, rollouts, index, _first(recorded.motion, len(frames)), person),
        achieved,
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
    """What the human hand of rollout `index` did in the demonstration's frames."""
    qpos, base = rollouts.qpos[index, rollouts.counted[index]], base_rotation(demonstration)
    turned = Rotation.from_matrix(base) * Rotation.from_euler("XYZ", qpos[:, 3:NUM_WRIST])
    return JointMotion(
        fps=rollouts.fps,
        angles=qpos[:, NUM_WRIST : NUM_WRIST + demonstration.motion.angles.shape[1]],
        wrist_position=qpos[:, :3] @ base.T,
        wrist_quaternion=turned.as_quat(scalar_first=True),
        valid=np.ones(len(qpos), bool),
        side=demonstration.motion.side,
        source="twin",
    )


def ghost(layer: MeshLayer) -> MeshLayer:
    """The layer, grey and faint."""
    return replace(layer, colour=_GHOST, opacity=_FAINT)


def _hands(
    env: TrackingEnv, rollouts: Rollouts, index: int, recorded: JointMotion, person: RigidHand
) -> tuple[MeshLayer | SkinLayer, ...]:
    """The twin and what the person did: the same hand's ghost; beside a robot a hand of skin's colour.

    Hidden at first are a human twin's skin, and of a robot where it is told to be.
    """
    which, frames = int(rollouts.demonstration[index]), np.flatnonzero(rollouts.counted[index])
    demonstration, robot = env.demonstrations[which], env.body.rigid is None
    model = demonstration_spec(demonstration, env.hands[which], visual=True).compile()
    twin = model_layer(model, rollouts.qpos[index, frames], "twin", edges=robot)
    did = twin_layer(recorded, person, "demonstration")
    if robot:
        hand = hand_coordinates(model, np.asarray(env.reference.targets)[which, frames])
        told = np.concatenate([hand, rollouts.object_reference[index, frames]], axis=1)
        on_twin = ghost(model_layer(model, told, "demonstration on the twin", edges=True, shown=False))
        return twin, replace(did, colour=SKIN, opacity=GLASS), on_twin
    done = twin_motion(demonstration, rollouts, index)
    skin = skin_layer(skinned_motion(done, demonstration.shape, person), load_hand(side=done.side), "twin, skin", False)
    return twin, skin, ghost(did)


def _first(motion: JointMotion, frames: int) -> JointMotion:
    """Its first frames."""
    return replace(
        motion,
        angles=motion.angles[:frames],
        wrist_position=motion.wrist_position[:frames],
        wrist_quaternion=motion.wrist_quaternion[:frames],
        valid=motion.valid[:frames],
    )
