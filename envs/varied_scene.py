"""Scenes with variations: the object's place, mass, friction and size, and the hand's gains, other than recorded."""

import dataclasses
from collections.abc import Sequence

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from envs.disturbances.variation import Variation, varied_gains, varied_object
from envs.scene import SUPPORT, demonstration_spec, spare_boxes
from mjx_hand.bodies.body import Body
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand


def varied_model(
    demonstration: Demonstration,
    hand: RigidHand | Body,
    variation: Variation,
    gains: Gains,
    *,
    spare: int = 0,
    motors: bool = False,
    contacts: str = "object",
) -> mujoco.MjModel:
    """The scene of a demonstration with a variation.

    Args:
        demonstration: what is recorded.
        hand: the twin's.
        variation: how the scene differs.
        gains: of the hand as it is meant.
        spare: boxes to add that touch nothing.
        motors: six on the object, as `scene_spec` has them.
        contacts: what the hand meets, as `scene_spec` has it.
    """
    varied = dataclasses.replace(demonstration, object=varied_object(demonstration.object, variation))
    own = varied_gains(gains, variation.gains)
    chosen = {"gains": own, "spare": spare, "assisted": motors, "contacts": contacts}
    spec = demonstration_spec(varied, hand, forces=True, **chosen)
    centre = demonstration.object_pose[0, :3] * (1, 1, 0)
    turn = Rotation.from_rotvec([0.0, 0.0, variation.turn])
    for k, place in enumerate(demonstration.support_position):
        box = spec.geom(f"{SUPPORT}{k}")
        box.pos = centre + turn.apply(place - centre) + np.array([*variation.move, 0.0])
        box.quat = turn.as_quat(scalar_first=True)
    model = spec.compile()
    # A short cut of MuJoCo's for what is not turned; engines that compile it in need the same of every scene.
    boxes = [model.geom(f"{SUPPORT}{k}").id for k in range(len(demonstration.support))]
    model.geom_sameframe[boxes] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
    return model


def varied_models(
    demonstrations: Sequence[Demonstration],
    hands: Sequence[RigidHand | Body],
    variations: Sequence[Sequence[Variation]],
    gains: Gains,
    contacts: str = "object",
) -> list[mujoco.MjModel]:
    """The scenes of all, a demonstration's own one after the other, with motors on their objects."""
    return [
        varied_model(d, hand, variation, gains, spare=spare, motors=True, contacts=contacts)
        for d, hand, own, spare in zip(demonstrations, hands, variations, spare_boxes(demonstrations), strict=True)
        for variation in own
    ]
