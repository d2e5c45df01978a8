"""Where up is in a recording, and when its object stops standing: from the object's poses alone.

Cameras do not know gravity. An object that stands at first shows it: its own z axis is up, and its lowest point is on
the table, below which it never is later.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from mjx_hand.errors import InputError
from mjx_hand.motion.scene import RecordedObject

_AWAY = 0.03  # m from where it stood: lifted
_BEFORE = 8  # frames before that are not counted as standing
_TILT, _LEVEL, _FRAMES = 0.09, 0.005, 10  # rad and m by which single poses are off; frames that are off together
_FEWEST = 10  # standing frames


@dataclasses.dataclass(frozen=True)
class SupportPlane:
    """The table that an object stands on at first.

    Attributes:
        up: unit vector in the recording's frame.
        height: of the table along it (m).
        lifted: first frame in which the object is away for good.
        standing: frames before it in which the object surely stands, from the first on.
    """

    up: Float[np.ndarray, "3"]
    height: float
    lifted: int
    standing: int


def estimate_support_plane(recorded: RecordedObject) -> SupportPlane:
    """Fit the table under an object whose own z axis points up while it stands.

    Least squares over two directions and a height: while it stands, the object's axis and lowest point; later, how far
    that point is below the table.

    Raises:
        InputError: the object does not stand still at first, or is never lifted.
    """
    frames = len(recorded.position)
    home = np.median(recorded.position[: max(frames // 4, 1)], axis=0)
    near = np.flatnonzero(np.linalg.norm(recorded.position - home, axis=1) < _AWAY)
    lifted = int(near[-1]) + 1 if near.size else 0
    standing = lifted - _BEFORE
    if standing < _FEWEST or lifted >= frames:
        raise InputError(
            f"the object stands still in {max(standing, 0)} of {frames} frames; give a recording that shows it stand "
            f"for at least {_FEWEST} frames, and then lifted"
        )
    corners = np.einsum("tij,vj->tvi", recorded.rotation, _outline(recorded.vertices)) + recorded.position[:, None]
    axis = recorded.rotation[:standing, :, 2]

    def off(x: Float[np.ndarray, "4"]) -> Float[np.ndarray, "r"]:
        up = x[:3] / np.linalg.norm(x[:3])
        lowest = (corners @ up).min(axis=1) - x[3]
        return np.concatenate(
            [
                (axis - up).ravel() / (_TILT * np.sqrt(standing)),
                lowest[:standing] / (_LEVEL * np.sqrt(standing)),
                np.minimum(lowest[lifted:], 0.0) / (_LEVEL * np.sqrt(_FRAMES)),
            ]
        )

    start = np.median(axis, axis=0)
    start /= np.linalg.norm(start)
    found = least_squares(off, [*start, np.median((corners[:standing] @ start).min(axis=1))]).x
    return SupportPlane(
        up=found[:3] / np.linalg.norm(found[:3]), height=float(found[3]), lifted=lifted, standing=standing
    )


def _outline(vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "c 3"]:
    """Few of a mesh's vertices, the furthest in each of many directions."""
    turn = np.arange(400) * (np.pi * (3 - np.sqrt(5)))  # a Fibonacci sphere
    height = np.linspace(-1, 1, 400)
    across = np.sqrt(1 - height**2)
    directions = np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
    return vertices[np.unique(np.argmax(vertices @ directions.T, axis=0))]


def world_from_recording(table: SupportPlane) -> Float[np.ndarray, "3 3"]:
    """The rotation to a world with z up; its x lies as near as it can to the recording's."""
    x = np.eye(3)[0] - table.up * table.up[0]
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(table.up, x), table.up])
