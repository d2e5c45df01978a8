"""`Placement`: where a source's frame lies in the world of the table."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from mjx_hand.hand.joints import LINKS
from mjx_hand.motion.make_scene import up_vector
from mjx_hand.rigid.rigid_hand import RigidHand

HEIGHT, BEHIND = 0.2, 0.2  # m: at first the wrist is so far above the table, and so far behind the object
_POINTS = 0.3  # of a unit vector: fingers that lie less flat than that point nowhere on the table


@dataclass(frozen=True)
class Placement:
    """world_from_source.

    Attributes:
        rotation, offset: of points p (m), rotation p + offset.
    """

    rotation: Float[np.ndarray, "3 3"]
    offset: Float[np.ndarray, "3"]

    def position(self, place: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """A place (m) in the world."""
        return self.rotation @ place + self.offset

    def quaternion(self, turn: Float[np.ndarray, "4"]) -> Float[np.ndarray, "4"]:
        """An orientation (wxyz) in the world."""
        out, own = np.zeros(4), np.zeros(4)
        mujoco.mju_mat2Quat(own, self.rotation.ravel())
        mujoco.mju_mulQuat(out, own, turn)
        return out


AS_IT_IS = Placement(np.eye(3), np.zeros(3))


def place_hand(
    position: Float[np.ndarray, "3"], quaternion: Float[np.ndarray, "4"], rigid: RigidHand, up: str, forward: str
) -> Placement:
    """The placement by which a hand is above the table and behind the object, its fingers towards it (world +x).

    Args:
        position, quaternion: of the wrist, in the source's frame (m, wxyz).
        rigid: the hand.
        up, forward: axes of the source: against gravity, and away from the person. The second counts where the fingers
            point up or down.
    """
    above, ahead = up_vector(up), up_vector(forward)
    assert above is not None
    assert ahead is not None
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quaternion)
    fingers = turn.reshape(3, 3) @ _unit(np.asarray(rigid.link_offset, float)[LINKS.index("middle1")])
    flat = fingers - (fingers @ above) * above
    if np.linalg.norm(flat) < _POINTS:
        flat = ahead - (ahead @ above) * above
    if np.linalg.norm(flat) < _POINTS:  # forward is up: any way will do
        flat = np.roll(above, 1)
    x = _unit(flat)
    rotation = np.stack([x, np.cross(above, x), above])
    return Placement(rotation, np.array([-BEHIND, 0.0, HEIGHT]) - rotation @ position)


def _unit(v: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    return v / np.linalg.norm(v)
