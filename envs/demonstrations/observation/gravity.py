"""Where up is in a recording that does not say: what stands shows it.

Cameras do not know gravity. An object that stands still does so on one of few faces; whichever that is, its lowest
point is on a table below which it never is, it first goes upwards, other objects stand as well, and hands come from
above. The way to stand that fits all of these best gives up, and least squares make it exact.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import least_squares

from envs.demonstrations.observation.solids import Solid
from envs.demonstrations.observation.stillness import ObjectPath
from mjx_hand.errors import InputError
from mjx_hand.motion.gaps import spans

_TILT, _LEVEL = 0.09, 0.005  # rad and m by which single poses are off
_TOGETHER = 10  # frames that are off together
_FIRST = 0.03  # m of its way that say in which direction it begins
_BENT = 0.3  # rad that a wrong way to stand is off, at most, where another object stands
_WEIGHTS = {"spread": 20.0, "below": 100.0, "others": 10.0, "first": 4.0, "hands": 3.0, "foot": 0.5}


def estimate_up(
    objects: Sequence[tuple[Solid, ObjectPath]],
    moved: int,
    untouched: Bool[np.ndarray, "t"],
    wrists: Float[np.ndarray, "t 3"],
    where: str,
) -> Float[np.ndarray, "3"]:
    """The unit vector against gravity in the scene's frame.

    Args:
        objects: all that have a surface.
        moved: which of them is moved.
        untouched: frames in which no hand is at it.
        wrists: of the hand that moves it; zero in gaps.
        where: the recording, for messages.

    Raises:
        InputError: it is never seen standing, or stands on no face, as balls do.
    """
    solid, path = objects[moved]
    resting = _first_rest(path, untouched)
    if resting is None:
        raise InputError(f"{where}: it is not said where up is and no object is seen at rest; {_GIVE}")
    if not len(solid.stands):
        raise InputError(f"{where}: it is not said where up is, and a ball does not show it; {_GIVE}")
    begin, end = resting
    costs = []
    for order, stand in enumerate(solid.stands):
        seen = path.rotation[begin:end] @ stand
        up = seen.mean(axis=0)
        spread = max(1 - float(np.linalg.norm(up)), 0.0)
        up /= np.linalg.norm(up)
        height = path.position @ up + solid.lowest(path.rotation, up)
        table = float(np.median(height[begin:end]))
        terms = {
            "spread": np.sqrt(spread),
            "below": max(table - _LEVEL - float(np.quantile(height[end:], 0.02)) if end < len(height) else 0.0, 0.0),
            "others": np.mean([_standing_error(*one, up) for k, one in enumerate(objects) if k != moved] or [0.0]),
            "first": 1 - _first_direction(path.position[end:], path.position[begin:end].mean(axis=0)) @ up,
            "hands": float(np.mean(wrists[untouched] @ up < table)) if untouched.any() else 0.0,
            "foot": np.log(solid.feet[0] / solid.feet[order]),
        }
        costs.append((sum(_WEIGHTS[name] * value for name, value in terms.items()), order, up, table))
    _, order, up, table = min(costs, key=lambda one: one[:2])
    return _refined(solid, path, solid.stands[order], up, table, begin, end)


_GIVE = "say it: data.recording.up=+z (or +x, -y, …, in the recording's axes), or mjx-hand scene --up +z"


def _first_rest(path: ObjectPath, untouched: Bool[np.ndarray, "t"]) -> tuple[int, int] | None:
    """The first span in which it stands still and nobody is at it; else the first in which it stands still."""
    for flags in (path.still & untouched & path.seen, path.still & path.seen):
        long = [span for span in spans(flags) if span[1] - span[0] >= 2]
        if long:
            return long[0]
    return None


def _standing_error(solid: Solid, path: ObjectPath, up: Float[np.ndarray, "3"]) -> float:
    """How far (rad) another object, while still, is from standing on one of its faces."""
    if not path.still.any() or not len(solid.stands):
        return 0.0
    seen = np.einsum("tji,j->ti", path.rotation[path.still], up)
    off = np.arccos(np.clip((seen @ solid.stands.T).max(axis=1), -1, 1))
    return float(min(np.median(off), _BENT))


def _first_direction(way: Float[np.ndarray, "n 3"], home: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    away = np.linalg.norm(way - home, axis=1)
    if not (away > _FIRST).any():
        return np.zeros(3)
    step = way[int(np.argmax(away > _FIRST))] - home
    return step / np.linalg.norm(step)


def _refined(
    solid: Solid,
    path: ObjectPath,
    stand: Float[np.ndarray, "3"],
    up: Float[np.ndarray, "3"],
    table: float,
    begin: int,
    end: int,
) -> Float[np.ndarray, "3"]:
    """Least squares over two directions and a height: the axis and the lowest point at rest; later, nothing below."""
    corners = np.einsum("tij,vj->tvi", path.rotation, solid.outline) + path.position[:, None]
    axis = path.rotation[begin:end] @ stand
    count = end - begin

    def off(x: Float[np.ndarray, "4"]) -> Float[np.ndarray, "r"]:
        direction = x[:3] / np.linalg.norm(x[:3])
        lowest = (corners @ direction).min(axis=1) - x[3]
        return np.concatenate(
            [
                (axis - direction).ravel() / (_TILT * np.sqrt(count)),
                lowest[begin:end] / (_LEVEL * np.sqrt(count)),
                np.minimum(lowest[end:], 0.0) / (_LEVEL * np.sqrt(_TOGETHER)),
            ]
        )

    found = least_squares(off, [*up, table]).x[:3]
    return found / np.linalg.norm(found)
