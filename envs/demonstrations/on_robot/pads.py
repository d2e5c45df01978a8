"""Where a person's fingers touch the object: places on the hand, followed through a demonstration."""

import dataclasses
from collections import Counter

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing
from scipy.spatial.transform import Rotation

from envs.model_grip import HOVER, NEAR, Touch
from envs.reference import demonstrated_targets
from envs.scene import demonstration_spec
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.bodies.human_body import human_body
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.gaps import spans
from mjx_hand.rigid.rigid_hand import RigidHand

_FLICKER = 0.2  # s, in which a finger that touches does not come off and back
_IN_AIR = 0.005  # m higher off table and support than at the beginning, where the object is in the air
_LET_GO = 0.01  # m that a pad moves on the object as it lets go in the air; capture noise moved pads by up to 5 mm


@dataclasses.dataclass(frozen=True)
class DemonstratedPads:
    """What a person's fingers do in a demonstration of t frames, in the world (m).

    Attributes:
        fingers: those that touch the object at `grasp`, which is the frame with most of them.
        places: of each one's pad, the point of its last touching link that is nearest to the object then.
        surface: the point of the object that is nearest to each pad, at `grasp`.
        inward: unit way from each pad into the object, at `grasp`.
        touching: whether each of these fingers touches; gaps of less than 0.2 s, as recordings have them, are filled,
            and others in the air unless the pad moves away by more than 1 cm: what is held stays held.
        in_air: whether the object is off table and support.
        tips: of all five fingers, by name.
        grasp: the frame.
        wraps: whether more than pads touch then, of three fingers and more: the palm, or all three phalanges of two.
    """

    fingers: tuple[str, ...]
    places: Float[np.ndarray, "t f 3"]
    surface: Float[np.ndarray, "f 3"]
    inward: Float[np.ndarray, "f 3"]
    touching: Bool[np.ndarray, "t f"]
    in_air: Bool[np.ndarray, "t"]
    tips: dict[str, np.ndarray]
    grasp: int
    wraps: bool


def demonstrated_pads(demonstration: Demonstration, person: RigidHand) -> DemonstratedPads:
    """The pads of a person's demonstration.

    The frame of the grasp is the last in which as many fingers touch as ever do while the object is off its support.
    """
    body = human_body(person)
    model = demonstration_spec(demonstration, body).compile()
    touch = Touch(model, body, palm=True)
    coordinates = hand_coordinates(model, demonstrated_targets(demonstration))
    found: dict[int, dict[str, tuple[int, float, np.ndarray, np.ndarray]]] = {}
    height = demonstration.object_pose[:, 2]
    for frame in range(demonstration.num_frames):
        touch.place(coordinates[frame], demonstration.object_pose[frame])
        near = {touch.fingers[k]: (k, gap, point, way) for k, gap, point, way in touch.nearest(NEAR)}
        near.pop("", None)
        if near:
            found[frame] = near  # each finger's last link, which comes last
    lifted = [frame for frame in found if height[frame] - height[0] > 0.3 * np.ptp(height)] or list(found)
    if not lifted:
        frames = demonstration.num_frames
        nowhere, never = np.zeros((0, 3)), np.zeros((frames, 0), bool)
        return DemonstratedPads(
            (), np.zeros((frames, 0, 3)), nowhere, nowhere, never, np.zeros(frames, bool), {}, 0, False
        )
    most = max(len(found[frame]) for frame in lifted)
    grasp = max(frame for frame in lifted if len(found[frame]) == most)
    fingers = tuple(sorted(found[grasp], key=lambda name: (name != "thumb", body.fingers.index(name))))
    touch.place(coordinates[grasp], demonstration.object_pose[grasp])
    held = [found[grasp][finger] for finger in fingers]
    touching_links = Counter(touch.fingers[k] for k, *_ in touch.nearest(NEAR))
    around = "" in touching_links or sum(count > 2 for count in touching_links.values()) > 1
    wraps = around and len(fingers) > 2  # a card between thumb and index finger may lie against the palm
    on_links = [(number, touch.on_link(number, point)) for number, _, point, _ in held]
    surface = np.stack([point + gap * way for _, gap, point, way in held])
    places = np.empty((demonstration.num_frames, len(fingers), 3))
    sites = {finger: model.site(f"{finger}_tip").id for finger in body.fingers}
    tips = {finger: np.empty((demonstration.num_frames, 3)) for finger in body.fingers}
    clearance = np.empty(demonstration.num_frames)
    for frame in range(demonstration.num_frames):
        touch.place(coordinates[frame], demonstration.object_pose[frame])
        clearance[frame] = touch.object_clearance()
        for k, (number, place) in enumerate(on_links):
            places[frame, k] = touch.in_world(number, place)
        for finger, site in sites.items():
            tips[finger][frame] = touch.data.site_xpos[site]
    near = np.array([[finger in found.get(frame, ()) for finger in fingers] for frame in range(len(places))])
    filled = np.ones((round(_FLICKER * demonstration.motion.fps), 1), bool)
    touching = binary_closing(np.pad(near, ((len(filled), len(filled)), (0, 0)), mode="edge"), filled)
    touching = touching[len(filled) : -len(filled)]
    in_air = clearance > min(clearance[0], HOVER) + _IN_AIR
    for k in range(len(fingers)):
        touching[:, k] |= stays_held(touching[:, k], on_object(places[:, k], demonstration.object_pose), in_air)
    inward = np.stack([way for *_, way in held])
    return DemonstratedPads(fingers, places, surface, inward, touching, in_air, tips, grasp, wraps)


def on_object(places: Float[np.ndarray, "t 3"], object_pose: Float[np.ndarray, "t 7"]) -> Float[np.ndarray, "t 3"]:
    """Where places (m, world) are as seen from the object, frame by frame."""
    turn = Rotation.from_quat(object_pose[:, 3:], scalar_first=True)
    return turn.inv().apply(places - object_pose[:, :3])


def stays_held(
    touching: Bool[np.ndarray, "t"], pad: Float[np.ndarray, "t 3"], in_air: Bool[np.ndarray, "t"]
) -> Bool[np.ndarray, "t"]:
    """Frames of gaps, from the air on up to the ground, in which a pad (m, on the object) stays where it touched."""
    held = np.zeros_like(touching)
    for first, end in spans(~touching):
        landed = first + int(np.argmin(np.append(in_air[first:end], False)))
        if first and landed > first:
            held[first:landed] = np.linalg.norm(pad[first:landed] - pad[first - 1], axis=1).max() < _LET_GO
    return held
