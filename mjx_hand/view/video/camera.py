"""Where the camera of a video stands: it glides after the object and looks at the hand from the thumb's side."""

import dataclasses

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from mjx_hand.errors import InputError

_HAND = "wrist"  # the body whose frame is the hand's: fingers along -x, thumb side +z
_AZIMUTH = 130.0  # where there is no hand, or its thumb points up or down


@dataclasses.dataclass(frozen=True)
class Camera:
    """Where the camera is.

    Attributes:
        follow: name of the body that stays in the middle, or None to look at the model's centre.
        distance: from what it looks at (m).
        azimuth: viewing direction (degrees), MuJoCo's convention: 90 looks along +y. None looks at the hand from the
            thumb's side and a little from the front, as it is halfway through.
        elevation: viewing direction (degrees), negative looks down.
        above: height (m) above the followed body's origin of the point that it looks at.
        smoothing: frames over which the camera's way is smoothed.
    """

    follow: str | None = "object"
    distance: float = 0.42
    azimuth: float | None = None
    elevation: float = -20.0
    above: float = 0.03
    smoothing: float = 12.0


def camera_path(model: mujoco.MjModel, qpos: Float[np.ndarray, "t nq"], camera: Camera) -> list[mujoco.MjvCamera]:
    """MuJoCo's camera for each row of qpos.

    Raises:
        InputError: the model has no body of the followed name.
    """
    data = mujoco.MjData(model)
    azimuth = _thumb_side(model, data, qpos[len(qpos) // 2]) if camera.azimuth is None else camera.azimuth
    path = []
    for point in _look_at(model, data, qpos, camera):
        view = mujoco.MjvCamera()
        view.distance, view.azimuth, view.elevation = camera.distance, azimuth, camera.elevation
        view.lookat[:] = point
        path.append(view)
    return path


def _look_at(
    model: mujoco.MjModel, data: mujoco.MjData, qpos: Float[np.ndarray, "t nq"], camera: Camera
) -> Float[np.ndarray, "t 3"]:
    if camera.follow is None:
        return np.tile(model.stat.center, (len(qpos), 1))
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, camera.follow)
    if body < 0:
        names = ", ".join(model.body(k).name for k in range(1, model.nbody))
        raise InputError(f"the model has no body {camera.follow!r} to follow; it has {names}")
    points = np.empty((len(qpos), 3))
    for k, row in enumerate(qpos):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        points[k] = data.xpos[body]
    points[:, 2] += camera.above
    return gaussian_filter1d(points, camera.smoothing, axis=0, mode="nearest")


def _thumb_side(model: mujoco.MjModel, data: mujoco.MjData, qpos: Float[np.ndarray, "nq"]) -> float:
    hand = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, _HAND)
    if hand < 0:
        return _AZIMUTH
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    turn = data.xmat[hand].reshape(3, 3)
    stand = (turn @ [-0.45, 0.0, 0.9])[:2]
    if np.linalg.norm(stand) < 0.3:
        return _AZIMUTH
    return float(np.rad2deg(np.arctan2(-stand[1], -stand[0])))
