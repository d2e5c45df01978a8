"""How a recorded hand takes an object into a grasp: it arrives with fingers open, closes, and carries.

The recorded reach is off by as much as capture is, so it goes over into the grasp's place before the lift. The
object's way, and with it the hand's from then on, are the recording's.
"""

import dataclasses
import functools

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import GraspPose, spin_of
from envs.demonstrations.from_recording.observed import ObservedSequence
from envs.demonstrations.from_recording.pregrasp import pregrasp
from envs.demonstrations.scripted.script import minimum_jerk
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.rigid.rigid_hand import RigidHand

# s before the lift: from when to when the wrist and the open fingers go over from the recorded reach to the grasp
# (made late, a correction of centimetres would go through the object), and from when to when the fingers close.
_ARRIVING, _CLOSING = (1.4, 0.75), (0.8, 0.4)
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
    """

    observed: ObservedSequence
    lifted: float
    held: GraspPose
    hand: RigidHand
    object: ObjectDescription

    @functools.cached_property
    def planes(self) -> Float[np.ndarray, "h f 4"]:
        """Of the object's convex pieces (`mjx_hand.objects.primitives.hull_planes`)."""
        return hull_planes(self.object.hulls)

    @property
    def closed(self) -> int:
        """The first frame in which the fingers are closed; object and hand are as in the grasp from then on."""
        return int(np.argmax(self._share(_CLOSING) >= 1.0))

    @property
    def closing(self) -> int:
        """The first frame in which they close."""
        return int(np.argmax(self._share(_CLOSING) > 0.0))

    def _share(self, between: tuple[float, float]) -> Float[np.ndarray, "t"]:
        """0 before, 1 after, minimum jerk between."""
        begin, end = between
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
    """How the recorded hand takes the object into each of n grasps."""
    observed, hand = act.observed, act.hand
    arriving, closing = (act._share(span)[:, None] for span in (_ARRIVING, _CLOSING))
    # An object that looks the same from all sides was turned about its axis otherwise than it seemed, and not the hand.
    spins = [spin_of(act.held.rotation.T @ rotation) for rotation in grasps.rotation]
    spun = Rotation.from_rotvec(np.array(spins)[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    rotation = observed.rotation @ spun[:, None]
    wrist_rotation = rotation @ np.swapaxes(grasps.rotation, 1, 2)[:, None]
    wrist_position = observed.position - np.einsum("ntij,nj->nti", wrist_rotation, grasps.position)
    spread = pregrasp(grasps, hand, act.planes, _CLEAR).angles[:, None]
    angles = observed.angles + arriving * (spread - observed.angles) + closing * (grasps.angles[:, None] - spread)
    return GraspTrajectory(
        angles=np.clip(angles, hand.hinge_lower, hand.hinge_upper),
        wrist_rotation=_turned(observed.hand_rotation, wrist_rotation, arriving),
        wrist_position=observed.hand_position + arriving * (wrist_position - observed.hand_position),
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
