"""The actuated wrist's six coordinates, for a hand that may turn any way.

The wrist of a scene slides along the axes of its base and turns from it, R = Rx Ry Rz, which is singular where Ry is a
quarter turn. A live hand gets there; so before it does, its base is laid where the wrist is: the same state, in other
coordinates.
"""

import mujoco
import numpy as np
from jaxtyping import Float

from envs.scene import NUM_WRIST

_MIDDLE, _OUTER = 1.0, 2.5  # rad of Ry, and of Rx and Rz, from which on the base is laid anew; the joints end at pi


class Wrist:
    """The wrist of one world.

    Args:
        model, data: of the world, whose joints begin with the wrist's.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData):
        self._model, self._data = model, data
        self._body = model.body("wrist").id

    @property
    def base(self) -> Float[np.ndarray, "3 3"]:
        """world_from_base."""
        return _matrix(self._model.body_quat[self._body])

    def coordinates(
        self, position: Float[np.ndarray, "3"], quaternion: Float[np.ndarray, "4"]
    ) -> Float[np.ndarray, "6"]:
        """Slides (m) and turns (rad) of a pose in the world (m, wxyz): of those that say it, the nearest to now's."""
        base, now = self.base, self._data.qpos[3:NUM_WRIST]
        r = base.T @ _matrix(quaternion)
        middle = np.arcsin(np.clip(r[0, 2], -1, 1))
        first, last = np.arctan2(-r[1, 2], r[2, 2]), np.arctan2(-r[0, 1], r[0, 0])
        ways = np.array([[first, middle, last], [first + np.pi, np.pi - middle, last + np.pi]])
        ways += 2 * np.pi * np.round((now - ways) / (2 * np.pi))
        turns = ways[np.argmin(np.abs(ways - now).sum(axis=1))]
        return np.concatenate([base.T @ position, turns])

    def place(self, position: Float[np.ndarray, "3"], quaternion: Float[np.ndarray, "4"]) -> None:
        """Put the wrist there, at rest, on a base of its own."""
        self._model.body_quat[self._body] = quaternion
        self._data.qpos[:NUM_WRIST] = [*(self.base.T @ position), 0, 0, 0]
        self._data.qvel[:NUM_WRIST] = 0

    def keep_regular(self) -> bool:
        """Lay the base anew where the wrist has turned far from it; whether it did."""
        turns = self._data.qpos[3:NUM_WRIST]
        if abs(turns[1]) < _MIDDLE and max(abs(turns[0]), abs(turns[2])) < _OUTER:
            return False
        old = self.base
        x, y, z = (_about(axis, angle) for axis, angle in enumerate(turns))
        # The columns are what each turn's rate adds to the angular velocity, in the old base's axes.
        rates = np.stack([np.eye(3)[0], x @ np.eye(3)[1], x @ y @ np.eye(3)[2]], axis=1)
        new_from_old = (x @ y @ z).T
        carry = np.zeros((6, 6))
        carry[:3, :3], carry[3:, 3:] = new_from_old, new_from_old @ rates
        data = self._data
        data.qpos[:3] = new_from_old @ data.qpos[:3]
        data.qpos[3:NUM_WRIST] = 0
        for values in (data.qvel, data.qacc_warmstart):
            values[:NUM_WRIST] = carry @ values[:NUM_WRIST]
        mujoco.mju_mat2Quat(self._model.body_quat[self._body], (old @ new_from_old.T).ravel())
        return True


def _matrix(quaternion: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3 3"]:
    out = np.zeros(9)
    mujoco.mju_quat2Mat(out, quaternion)
    return out.reshape(3, 3)


def _about(axis: int, angle: float) -> Float[np.ndarray, "3 3"]:
    quaternion = np.zeros(4)
    mujoco.mju_axisAngle2Quat(quaternion, np.eye(3)[axis], angle)
    return _matrix(quaternion)
