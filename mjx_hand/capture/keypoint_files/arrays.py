"""Keypoints as plain arrays: `joints` (T, n, 3), or one array a hand, with what else the file says beside it.

In an `.npz`, a pickled dictionary, or, a lone array without a name, in an `.npy` or pickle. Names read: the points as
`joints`, `keypoints`, `landmarks`, `positions` or `points`, any other name that speaks of them where there is one such
array, or a hand each as `right` and `left`; `fps`, times as `t`, `time` or `timestamp` (`_ms` says a unit), frame
numbers as `frame`; `side`, `unit` (m, cm or mm), `layout` (a name in `layouts.LAYOUTS`) and `names` or `joint_names`,
one a point. One frame (n, 3) and flat rows (T, 3 n) are read too.
"""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.reader import ARRAYS, KeypointReader
from mjx_hand.capture.keypoint_frames.json_hands import side_of, snake
from mjx_hand.capture.keypoint_frames.timed_hand import timed_hand
from mjx_hand.capture.keypoints.names import COUNTS, counted_keypoints, named_keypoints
from mjx_hand.capture.keypoints.recording import SIDES, KeypointRecording
from mjx_hand.capture.keypoints.size import unit_factor
from mjx_hand.capture.timeline.clock_names import names_numbers, names_time
from mjx_hand.capture.timeline.compare_clocks import stated_rate, timeline_of
from mjx_hand.capture.timeline.timeline import Timeline
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import WHOLE, plain
from mjx_hand.files.safe_pickle import Record

_POINTS = ("joints", "keypoints", "landmarks", "positions", "points")
_NAMES = ("names", "joint_names")
_BESIDE = {*_NAMES, "fps", "frame_rate", "side", "hand", "unit", "units", "layout", "source"}
_SPEAKS = re.compile(r"joint|keypoint|landmark|kpt|kps|position|point|skeleton|hand|xyz", re.IGNORECASE)


def _points_in(arrays: Any) -> dict[str, str]:
    """The names of the arrays that are hands' points, and the side that each names or ""."""
    others = [n for n in arrays if n not in _BESIDE and not names_time(str(n)) and not names_numbers(str(n))]
    sides = {name: side_of(re.sub(r"_?(joints|keypoints|landmarks)_?", "", snake(str(name)))) for name in others}
    known = [name for name in others if name in _POINTS or name == WHOLE or sides[name]]
    if not known and len(others) == 1 and _SPEAKS.search(str(others[0])):
        known = others
    # Only files that hold nothing else: many datasets have `joints` beside what they are really about.
    if not others or len(known) < len(others) or not all(_shaped(arrays[name]) for name in known):
        return {}
    return {name: sides[name] for name in known}


def _array(value: Any) -> np.ndarray | None:
    """The array of numbers that a value is, if it is one."""
    if isinstance(value, Record | list | tuple):
        try:
            value = plain("", "", value)
        except InputError:
            return None
    return value if isinstance(value, np.ndarray) and value.dtype.kind in "fiu" else None


def _shaped(value: Any) -> bool:
    array = _array(value)
    if array is None:
        return False
    hands = array.ndim == 3 and array.shape[2] == 3
    frame = array.ndim == 2 and array.shape[1] == 3 and array.shape[0] in COUNTS
    flat = array.ndim == 2 and array.shape[1] % 3 == 0 and array.shape[1] // 3 in COUNTS
    return hands or frame or flat


def _recognises(arrays: Any) -> bool:
    return isinstance(arrays, Mapping) and bool(_points_in(arrays))


def _read(path: Path, arrays: Any, unit: str | None) -> dict[str, KeypointRecording]:
    def said(*names: str) -> str | None:
        value = next((arrays[name] for name in names if name in arrays), None)
        return None if value is None else _text(value)

    factor = unit_factor(str(path), unit or said("unit", "units") or "m")
    names = next((arrays[key] for key in _NAMES if key in arrays), None)
    found = {}
    for name, side in _points_in(arrays).items():
        array = _array(arrays[name])
        assert array is not None, "as recognised"
        if not len(array):
            what = name or "its array"
            raise InputError(f"{path}: the recording has no frames ({what} has shape {array.shape}); save at least one")
        rows = len(array) if array.ndim == 3 or array.shape[1] != 3 else 1
        points = array.reshape(rows, -1, 3).astype(float)
        points = np.where(np.isfinite(points), points, np.nan) * factor
        if names is None:
            positions, layout = counted_keypoints(path, points, said("layout"))
        else:
            positions, layout = named_keypoints(path, [str(n) for n in np.atleast_1d(_lone(names))], points)
        side = side or (said("side", "hand") or "").lower()
        found[side if side in SIDES else str(name) or "hand"] = timed_hand(
            path, positions, _timeline(path, arrays, rows), side=side, layout=layout
        )
    return found


def _timeline(path: Path, arrays: Any, rows: int) -> Timeline:
    def stamps(named: Callable[[str], bool]) -> tuple[str, np.ndarray | None]:
        key = next((key for key in arrays if named(str(key))), None)
        if key is None:
            return "", None
        array = {str(key): np.asarray(_array(arrays[key]))}
        return str(key), numbers(path, array, {str(key): (rows,)}, finite=False)[str(key)].astype(float)

    rate = next((arrays[key] for key in ("fps", "frame_rate") if key in arrays), None)
    name, times = stamps(names_time)
    return timeline_of(
        path,
        rows,
        rate=None if rate is None else stated_rate(path, "fps", _lone(rate)),
        times=times,
        name=name,
        numbers=stamps(names_numbers)[1],
    )


def _lone(value: Any) -> Any:
    """What an array of one element holds; any other array as lists."""
    if isinstance(value, Record | list | tuple) and (array := _array(value)) is not None:
        value = array
    if not isinstance(value, np.ndarray):
        return value
    return value.item() if value.size == 1 else value.tolist()


def _text(value: Any) -> str:
    lone = _lone(value)
    return lone.decode("utf-8", "replace") if isinstance(lone, bytes) else str(lone)


READER = KeypointReader(
    name="keypoint arrays (`joints` (T, n, 3))", container=ARRAYS, recognises=_recognises, read=_read
)
