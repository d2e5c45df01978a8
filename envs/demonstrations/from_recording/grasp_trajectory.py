"""How a recorded hand takes an object into a grasp: it arrives with fingers open, closes, and carries.

The recorded reach is off by as much as capture is, so it goes over into the grasp's place before the lift, no earlier
than the recorded hand is there. The object's way, and with it the hand's from then on, are the recording's.
"""

import dataclasses
import functools

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import GraspPose, spins
from envs.demonstrations.from_recording.observed import ObservedSequence
from envs.demonstrations.from_recording.pregrasp import pregrasp
from envs.demonstrations.scripted.script import minimum_jerk
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.rigid.rigid_hand import RigidHand

# s: how long the wrist and the open fingers take from the recorded reach to the grasp (made late, a correction
# of centimetres would go through the object), and how long the fingers to close at most, and at least.
_ARRIVING, _CLOSING, _QUICKEST = 0.65, 0.4, 0.25
_EARLIEST, _LATEST = 0.8, 0.05  # s before the lift: when fingers begin to close at the earliest, and are closed
_CLEAR = 0.012  # m from open fingers to the object


@dataclasses.dataclass(frozen=True)
class Act:
    """What a recording shows, and of what.

    Attributes:
        observed: hand and object.
        lifted: when the object is (s).
        held: how it then lies in the hand, as captured.
        hand: the twin's.
        object: a mesh.
        spun: whether it may have been turned about its z axis by any angle, which was not seen.
        support, support_position: half extents and centres of the boxes that it stands on beside the table (m).
    """

    observed: ObservedSequence
    lifted: float
    held: GraspPose
    hand: RigidHand
    object: ObjectDescription
    spun: bool = True
    support: Float[np.ndarray, "b 3"] = dataclasses.field(default_factory=lambda: np.zeros((0, 3)))
    support_position: Float[np.ndarray, "b 3"] = dataclasses.field(default_factory=lambda: np.zeros((0, 3)))

    @functools.cached_property
    def planes(self) -> Float[np.ndarray, "h f 4"]:
        """Of the object's convex pieces (`mjx_hand.objects.primitives.hull_planes`)."""
        return hull_planes(self.object.hulls)

    @property
    def closed(self) -> int:
        """The first frame in which the fingers are closed; object and hand are as in the grasp from then on."""
        return int(np.argmax(self.closing_share >= 1.0))

    @property
    def closing(self) -> int:
        """The first frame in which they close."""
        return int(np.argmax(self.closing_share > 0.0))

    @property
    def last_rest(self) -> int:
        """The last frame before the lift."""
        return int(np.searchsorted(self.observed.times, self.lifted - 1e-6)) - 1

    @functools.cached_property
    def closing_share(self) -> Float[np.ndarray, "t"]:
        """How far the fingers are closed: from when the recorded hand is where it lifts from, if there is time."""
        place = self.observed.hand_position[: self.last_rest + 1]
        away = np.linalg.norm(place - place[-1], axis=1) > _CLEAR
        there = self.observed.times[len(away) - int(np.argmax(away[::-1])) if away.any() else 0]
        begin = float(np.clip(self.lifted - there, _QUICKEST + _LATEST, _EARLIEST))
        return self._share(begin, max(begin - _CLOSING, _LATEST))

    @functools.cached_property
    def arriving_share(self) -> Float[np.ndarray, "t"]:
        """How far the wrist has gone over from the recorded reach to the grasp: wholly when the fingers close."""
        arrived = self.lifted - float(self.observed.times[max(self.closing - 1, 0)])
        return self._share(min(arrived + _ARRIVING, self.lifted), arrived)

    def _share(self, begin: float, end: float) -> Float[np.ndarray, "t"]:
        """0 until `begin` s before the lift, 1 from `end` s before it on, minimum jerk between."""
        return minimum_jerk((self.observed.times - self.lifted + begin) / (begin - end))


@dataclasses.dataclass(frozen=True)
class GraspTrajectory:
    """n ways in which a hand takes an object, t frames; metres, radians, world frame.

    Attributes:
        angles: hinge angles.
        wrist_rotation, wrist_position: the hand.
        rotation, position: the object.
    """

    angles: Float[np.ndarray, "n t 20"]
    wrist_rotation: Float[np.ndarray, "n t 3 3"]
    wrist_position: Float[np.ndarray, "n t 3"]
    rotation: Float[np.ndarray, "n t 3 3"]
    position: Float[np.ndarray, "t 3"]

    @property
    def in_hand(self) -> tuple[Float[np.ndarray, "n t 3 3"], Float[np.ndarray, "n t 3"]]:
        """The object's rotation and position in the wrist's frame."""
        wrist = np.swapaxes(self.wrist_rotation, -1, -2)
        return wrist @ self.rotation, np.einsum("ntij,ntj->nti", wrist, self.position - self.wrist_position)


def grasp_trajectory(act: Act, grasps: GraspPose) -> GraspTrajectory:
    """How the recorded hand takes the object into each of n grasps: along its reach, which is put beside the recorded
    one by as much as the grasp is."""
    observed, hand = act.observed, act.hand
    arriving, closing = act.arriving_share[:, None], act.closing_share[:, None]
    # An object that looks the same from all sides was turned about its axis otherwise than it seemed, and not the hand.
    spin = spins(grasps, act.held) if act.spun else np.zeros(len(grasps.angles))
    spun = Rotation.from_rotvec(spin[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    rotation = observed.rotation @ spun[:, None]
    wrist_rotation = rotation @ np.swapaxes(grasps.rotation, 1, 2)[:, None]
    wrist_position = observed.position - np.einsum("ntij,nj->nti", wrist_rotation, grasps.position)
    beside = wrist_position[:, act.last_rest, None] - observed.hand_position[act.last_rest]
    reach = observed.hand_position + arriving * beside
    spread = pregrasp(grasps, hand, act.planes, _CLEAR).angles[:, None]
    angles = observed.angles + arriving * (spread - observed.angles) + closing * (grasps.angles[:, None] - spread)
    return GraspTrajectory(
        angles=np.clip(angles, hand.hinge_lower, hand.hinge_upper),
        wrist_rotation=_turned(observed.hand_rotation, wrist_rotation, arriving),
        wrist_position=reach + closing * (wrist_position - reach),
        rotation=rotation,
        position=observed.position,
    )


def _turned(
    begin: Float[np.ndarray, "t 3 3"], end: Float[np.ndarray, "n t 3 3"], share: Float[np.ndarray, "t 1"]
) -> Float[np.ndarray, "n t 3 3"]:
    """Between two orientations, by the shortest turn."""
    first = Rotation.from_matrix(np.broadcast_to(begin, end.shape).reshape(-1, 3, 3))
    whole = (first.inv() * Rotation.from_matrix(end.reshape(-1, 3, 3))).as_rotvec().reshape(*end.shape[:2], 3)
    return (first * Rotation.from_rotvec((share * whole).reshape(-1, 3))).as_matrix().reshape(end.shape)
