"""Where a person's fingers touch the object: places on the hand, followed through a demonstration."""

import dataclasses

import numpy as np
from jaxtyping import Float

from envs.model_grip import NEAR, Touch
from envs.reference import demonstrated_targets
from envs.scene import demonstration_spec
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.bodies.human_body import human_body
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.rigid_hand import RigidHand


@dataclasses.dataclass(frozen=True)
class Pads:
    """What a person's fingers do in a demonstration of t frames, in the world (m).

    Attributes:
        fingers: those that touch the object at `grasp`, which is the frame with most of them.
        places: of each one's pad, the point of its last touching link that is nearest to the object then.
        inward: unit way from each pad into the object, at `grasp`.
        tips: of all five fingers, by name.
        grasp: the frame.
    """

    fingers: tuple[str, ...]
    places: Float[np.ndarray, "t f 3"]
    inward: Float[np.ndarray, "f 3"]
    tips: dict[str, np.ndarray]
    grasp: int


def demonstrated_pads(demonstration: Demonstration, person: RigidHand) -> Pads:
    """The pads of a person's demonstration.

    The frame of the grasp is the last in which as many fingers touch as ever do while the object is off its support.
    """
    body = human_body(person)
    model = demonstration_spec(demonstration, body).compile()
    touch = Touch(model, body)
    coordinates = hand_coordinates(model, demonstrated_targets(demonstration))
    found: dict[int, dict[str, tuple[int, np.ndarray, np.ndarray]]] = {}
    height = demonstration.object_pose[:, 2]
    for frame in range(demonstration.num_frames):
        touch.place(coordinates[frame], demonstration.object_pose[frame])
        near = {touch.fingers[k]: (k, point, way) for k, _, point, way in touch.nearest(NEAR)}  # the last link wins
        if near:
            found[frame] = near
    lifted = [frame for frame in found if height[frame] - height[0] > 0.3 * np.ptp(height)] or list(found)
    if not lifted:
        return Pads((), np.zeros((demonstration.num_frames, 0, 3)), np.zeros((0, 3)), {}, 0)
    most = max(len(found[frame]) for frame in lifted)
    grasp = max(frame for frame in lifted if len(found[frame]) == most)
    fingers = tuple(sorted(found[grasp], key=lambda name: (name != "thumb", body.fingers.index(name))))
    touch.place(coordinates[grasp], demonstration.object_pose[grasp])
    held = [found[grasp][finger] for finger in fingers]
    on_links = [(number, touch.on_link(number, point)) for number, point, _ in held]
    places = np.empty((demonstration.num_frames, len(fingers), 3))
    sites = {finger: model.site(f"{finger}_tip").id for finger in body.fingers}
    tips = {finger: np.empty((demonstration.num_frames, 3)) for finger in body.fingers}
    for frame in range(demonstration.num_frames):
        touch.place(coordinates[frame], demonstration.object_pose[frame])
        for k, (number, place) in enumerate(on_links):
            places[frame, k] = touch.in_world(number, place)
        for finger, site in sites.items():
            tips[finger][frame] = touch.data.site_xpos[site]
    return Pads(fingers, places, np.stack([way for *_, way in held]), tips, grasp)
