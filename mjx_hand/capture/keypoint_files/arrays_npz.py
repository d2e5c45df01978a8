"""Keypoints as plain arrays: `joints` (T, n, 3), or one array a hand, with what else the file says beside it.

Names read: the points as `joints`, `keypoints`, `landmarks`, `positions` or `points`, or a hand each as `right` and
`left`; `fps`, times as `t`, `time` or `timestamp` (`timestamp_ms` says a unit), frame numbers as `frame`; `side`,
`unit` (m, cm or mm), `layout` (a name in `layouts.LAYOUTS`) and `names` or `joint_names`, one a point.
"""

from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.reader import KeypointReader
from mjx_hand.capture.keypoint_files.timed_hand import timed_hand
from mjx_hand.capture.keypoints.names import counted_keypoints, named_keypoints
from mjx_hand.capture.keypoints.recording import SIDES, KeypointRecording
from mjx_hand.capture.keypoints.size import unit_factor
from mjx_hand.capture.timeline.clock_names import names_numbers, names_time
from mjx_hand.capture.timeline.compare_clocks import stated_rate, timeline_of
from mjx_hand.capture.timeline.timeline import Timeline
from mjx_hand.files.checked_arrays import numbers

POINTS = ("joints", "keypoints", "landmarks", "positions", "points", *SIDES)
NAMES = ("names", "joint_names")
_KNOWN = {*POINTS, *NAMES, "fps", "side", "unit", "layout", "source"}


def _known(name: str) -> bool:
    return name in _KNOWN or names_time(name) or names_numbers(name)


def _recognises(arrays: Any) -> bool:
    hands = [np.shape(arrays[name]) for name in POINTS if name in arrays]
    # Only files that hold nothing else: many datasets have `joints` beside what they are really about.
    return bool(hands) and all(map(_known, arrays)) and all(len(s) == 3 and s[2] == 3 for s in hands)


def _read(path: Path, arrays: Any, unit: str | None) -> dict[str, KeypointRecording]:
    def said(name: str) -> str | None:
        return str(arrays[name]) if name in arrays else None

    factor = unit_factor(str(path), unit or said("unit") or "m")
    found = {}
    for name in (name for name in POINTS if name in arrays):
        points = numbers(path, arrays, {name: ("t", "n", 3)}, finite=False)[name].astype(float)
        points = np.where(np.isfinite(points), points, np.nan) * factor
        names = next((arrays[key] for key in NAMES if key in arrays), None)
        if names is None:
            positions, layout = counted_keypoints(path, points, said("layout"))
        else:
            positions, layout = named_keypoints(path, [str(n) for n in np.atleast_1d(names)], points)
        side = name if name in SIDES else said("side") or ""
        found[side or name] = timed_hand(
            path, positions, _timeline(path, arrays, len(points)), side=side, layout=layout
        )
    return found


def _timeline(path: Path, arrays: Any, rows: int) -> Timeline:
    def stamps(key: str | None) -> np.ndarray | None:
        return None if key is None else numbers(path, arrays, {key: (rows,)}, finite=False)[key].astype(float)

    time = next(filter(names_time, arrays), None)
    return timeline_of(
        path,
        rows,
        rate=stated_rate(path, "fps", arrays["fps"].tolist()) if "fps" in arrays else None,
        times=stamps(time),
        name=time or "",
        numbers=stamps(next(filter(names_numbers, arrays), None)),
    )


READER = KeypointReader(name="keypoint arrays (`joints` (T, n, 3))", suffix=".npz", recognises=_recognises, read=_read)
