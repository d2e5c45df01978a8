"""Where a robot's pads go: with the object while the person's finger touches it, else with the person's pad.

A recording has fingers that touch up to 7 mm off the surface or inside it, differently in each frame. What holds an
object does not slide on it: while a finger touches, its pad keeps its place on the object.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import distance_transform_edt
from scipy.spatial.transform import Rotation

from envs.demonstrations.on_robot.pads import DemonstratedPads, on_object
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.gaps import spans
from mjx_hand.smoothstep import smoothstep

_ONTO = 0.1  # s from touching to going with the object, and back
_CLOSING = 0.2  # s in which a pad comes from its clearance to the surface: in half of it, bottles were knocked over
_AT_REST = 0.005  # m from where the object stands at the beginning or the end


def followed_places(
    pads: DemonstratedPads, grasp: Float[np.ndarray, "f 3"], demonstration: Demonstration
) -> Float[np.ndarray, "t f 3"]:
    """Where each pad is to be in each frame (m, world), if in the grasp's frame they are at `grasp` (m, world).

    Seen from the object a pad is always as far from the person's as at the grasp, but for the person's slip meanwhile.
    """
    position = demonstration.object_pose[:, :3]
    turn = Rotation.from_quat(demonstration.object_pose[:, 3:], scalar_first=True)
    wanted = np.empty_like(pads.places)
    for k, place in enumerate(grasp):
        own = on_object(pads.places[:, k], demonstration.object_pose)  # the person's
        stuck = own.copy()
        for first, end in spans(pads.touching[:, k]):
            inside = first <= pads.grasp < end
            stuck[first:end] = own[pads.grasp] if inside else own[first:end].mean(axis=0)
        share = onto(pads.touching[:, k], demonstration.motion.fps)[:, None]
        off = turn[pads.grasp].inv().apply(place - position[pads.grasp]) - own[pads.grasp]
        wanted[:, k] = position + turn.apply(own + share * (stuck - own) + off)
    return wanted


def opposed(
    touching: Bool[np.ndarray, "t f"],
    opposing: Bool[np.ndarray, "f"],
    place: Float[np.ndarray, "t 3"],
    in_air: Bool[np.ndarray, "t"],
) -> Bool[np.ndarray, "t f"]:
    """Which fingers touch, without those that are alone on their side of an object that stands.

    A person's thumb is near a bottle half a second before a finger is; a robot's would knock it over meanwhile.

    Args:
        touching: of each finger.
        opposing: which fingers oppose the others.
        place: of the object (m).
        in_air: whether it is in the air.
    """
    at_rest = np.minimum(*(np.linalg.norm(place - place[end], axis=1) for end in (0, -1))) < _AT_REST
    stands = at_rest & ~in_air
    both = touching[:, opposing].any(axis=1) & touching[:, ~opposing].any(axis=1)
    return touching & (both | ~stands)[:, None]


def onto(touching: Bool[np.ndarray, "t"], fps: float, seconds: float = _ONTO) -> Float[np.ndarray, "t"]:
    """How much a pad goes with the object, from 0 to 1 and back without a jolt; a demonstration's ends are none."""
    ramp = round(seconds * fps) + 1
    inside = np.asarray(distance_transform_edt(np.pad(touching, ramp, mode="edge")))[ramp:-ramp]
    return smoothstep(inside / ramp)


def still_near(touching: Bool[np.ndarray, "t"], fps: float) -> Float[np.ndarray, "t"]:
    """How near a pad is to be in each frame, from 0 to 1.

    It closes as `onto`, more slowly, and opens only after it touched.
    """
    late = touching.copy()
    for frames in range(1, round(_CLOSING * fps) + 1):
        late[frames:] |= touching[:-frames]
    return onto(late, fps, _CLOSING)
