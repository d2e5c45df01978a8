"""Where a robot's pads go: with the object while the person's finger touches it, else with the person's pad.

A recording has fingers that touch up to 7 mm off the surface or inside it, differently in each frame. What holds an
object does not slide on it: while a finger touches, its pad keeps its place on the object.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import distance_transform_edt
from scipy.spatial.transform import Rotation

from envs.demonstrations.on_robot.pads import Pads
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.gaps import spans
from mjx_hand.smoothstep import smoothstep

_ONTO = 0.1  # s from touching to going with the object, and back


def followed_places(
    pads: Pads, grasp: Float[np.ndarray, "f 3"], demonstration: Demonstration
) -> Float[np.ndarray, "t f 3"]:
    """Where each pad is to be in each frame (m, world), if in the grasp's frame they are at `grasp` (m, world).

    Seen from the object a pad is always as far from the person's as at the grasp, but for the person's slip meanwhile.
    """
    position = demonstration.object_pose[:, :3]
    turn = Rotation.from_quat(demonstration.object_pose[:, 3:], scalar_first=True)
    wanted = np.empty_like(pads.places)
    for k, place in enumerate(grasp):
        own = turn.inv().apply(pads.places[:, k] - position)  # the person's
        stuck = own.copy()
        for first, end in spans(pads.touching[:, k]):
            inside = first <= pads.grasp < end
            stuck[first:end] = own[pads.grasp] if inside else own[first:end].mean(axis=0)
        share = onto(pads.touching[:, k], demonstration.motion.fps)[:, None]
        off = turn[pads.grasp].inv().apply(place - position[pads.grasp]) - own[pads.grasp]
        wanted[:, k] = position + turn.apply(own + share * (stuck - own) + off)
    return wanted


def onto(touching: Bool[np.ndarray, "t"], fps: float) -> Float[np.ndarray, "t"]:
    """How much a pad goes with the object, from 0 to 1 and back without a jolt; a demonstration's ends are none."""
    ramp = round(_ONTO * fps) + 1
    inside = np.asarray(distance_transform_edt(np.pad(touching, ramp, mode="edge")))[ramp:-ramp]
    return smoothstep(inside / ramp)


def still_near(touching: Bool[np.ndarray, "t"], fps: float) -> Float[np.ndarray, "t"]:
    """How near a pad is to be in each frame, from 0 to 1: it closes as `onto`, and opens only after it touched."""
    late = touching.copy()
    for frames in range(1, round(_ONTO * fps) + 1):
        late[frames:] |= touching[:-frames]
    return onto(late, fps)
