"""The joints of one hand in JSON: listed, flat, or by name, each a place in one of the forms that devices write."""

from typing import Any

import numpy as np

from mjx_hand.capture.keypoints.names import names_a_hand

Point = list[float]

# Under which keys a joint's place stands; where a world's place is there, `position` may be relative to the parent.
_PLACES = (
    *("worldPosition", "globalPosition", "position", "pose", "jointPose", "transform", "worldMatrix", "offsetMatrix"),
    *("matrix", "translation", "location"),
)
_NAMES = ("name", "joint", "jointName", "joint_name", "part")
_DEEPEST = 4  # a place within a transform within a pose
_FEWEST = 5  # points of a list that may be a hand's


def is_number(value: Any) -> bool:
    """Whether a JSON value is a number; true and false are none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def hand_points(value: Any) -> tuple[np.ndarray, tuple[str, ...]] | None:
    """Points (n, 3) and names of one hand's joints; None if the value is something else."""
    if isinstance(value, dict) and names_a_hand(list(value)):
        return _named(list(value), list(value.values()))
    if not isinstance(value, list) or len(value) < _FEWEST:
        return None
    if all(is_number(each) for each in value):
        return (np.array(value, float).reshape(-1, 3), ()) if len(value) % 3 == 0 else None
    names = [name for name in map(_name, value) if name is not None]
    if len(names) == len(value):
        return _named(names, value)
    points = [place_of(each) for each in value]
    return None if None in points or value.count(None) == len(value) else (np.array(points, float), ())


def _named(names: list[str], values: list[Any]) -> tuple[np.ndarray, tuple[str, ...]] | None:
    """Those of named values that are places, if any is."""
    places = [(name, place_of(value)) for name, value in zip(names, values, strict=True)]
    kept = [(name, place) for name, place in places if place is not None]
    if all(np.isnan(place).all() for _, place in kept):
        return None
    return np.array([place for _, place in kept], float), tuple(name for name, _ in kept)


def _name(value: Any) -> str | None:
    if not isinstance(value, dict):
        return None
    return next((value[key] for key in _NAMES if isinstance(value.get(key), str)), None)


def place_of(value: Any, depth: int = 0) -> Point | None:
    """A point's coordinates, NaN for one that is null; None if the value is no point.

    A list of three, `{x, y, z}`, or a rigid transform's matrix of 12 or 16 numbers, written row by row or column by
    column, itself or as its `position`, `pose`, `transform`, `matrix`, …
    """
    if value is None:
        return [np.nan] * 3
    if depth > _DEEPEST:
        return None
    if isinstance(value, dict):
        axes = {str(key).lower(): each for key, each in value.items() if str(key).lower() in ("x", "y", "z")}
        if len(axes) == 3:
            return place_of([axes[axis] for axis in "xyz"], depth + 1)
        # An object with a 16th number: browsers write a Float32Array so.
        if value.keys() >= {str(k) for k in range(16)}:
            return place_of([value[str(k)] for k in range(16)], depth + 1)
        key = next((key for key in _PLACES if isinstance(value.get(key), dict | list)), None)
        return None if key is None else place_of(value[key], depth + 1)
    if not isinstance(value, list):
        return None
    if len(value) in (3, 4) and all(isinstance(row, list) and len(row) == 4 for row in value):
        value = [each for row in value for each in row]
    if len(value) == 3 and all(each is None or is_number(each) for each in value):
        return [np.nan if each is None else float(each) for each in value]
    if len(value) in (12, 16) and all(is_number(each) for each in value):
        return _translation([float(each) for each in value])
    return None


def _translation(matrix: list[float]) -> Point | None:
    """The place that a transform's matrix moves the origin to; its last row tells how it is written."""
    if len(matrix) == 12 or (matrix[12:15] == [0, 0, 0] and matrix[15] == 1):
        by_rows = [matrix[3], matrix[7], matrix[11]]
        if by_rows != [0, 0, 0] or len(matrix) == 12:
            return by_rows
    if (matrix[3], matrix[7], matrix[11], matrix[15]) == (0, 0, 0, 1):
        return matrix[12:15]
    return None
