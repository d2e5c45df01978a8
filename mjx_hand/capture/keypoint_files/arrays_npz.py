"""Keypoints as plain arrays: `joints` (T, n, 3), or one array a hand, with what else the file says beside it.

Names read: the points as `joints`, `keypoints`, `landmarks`, `positions` or `points`, or a hand each as `right` and
`left`; `fps` or times as `t`, `time`, `times` or `timestamps`; `side`, `unit` (m, cm or mm), `layout` (a name in
`layouts.LAYOUTS`) and `names` or `joint_names`, one a point.
"""

from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.reader import KeypointReader
from mjx_hand.capture.keypoints.names import counted_keypoints, named_keypoints
from mjx_hand.capture.keypoints.recording import SIDES, KeypointRecording, check_keypoints
from mjx_hand.capture.keypoints.size import unit_factor
from mjx_hand.capture.keypoints.times import evenly, stated_rate
from mjx_hand.files.checked_arrays import numbers

POINTS = ("joints", "keypoints", "landmarks", "positions", "points", *SIDES)
TIMES = ("t", "time", "times", "timestamps")
NAMES = ("names", "joint_names")
_KNOWN = {*POINTS, *TIMES, *NAMES, "fps", "side", "unit", "layout", "source"}


def _recognises(arrays: Any) -> bool:
    hands = [np.shape(arrays[name]) for name in POINTS if name in arrays]
    # Only files that hold nothing else: many datasets have `joints` beside what they are really about.
    return bool(hands) and set(arrays) <= _KNOWN and all(len(s) == 3 and s[2] == 3 for s in hands)


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
        fps = stated_rate(path, "fps", arrays["fps"].tolist()) if "fps" in arrays else None
        times = next((key for key in TIMES if key in arrays), None)
        if fps is None and times is not None:
            fps, positions = evenly(path, numbers(path, arrays, {times: (len(points),)})[times], positions)
        side = name if name in SIDES else said("side") or ""
        recording = KeypointRecording(fps=fps, positions=positions, side=side, layout=layout, source=path.name)
        found[side or name] = check_keypoints(recording)
    return found


READER = KeypointReader(name="keypoint arrays (`joints` (T, n, 3))", suffix=".npz", recognises=_recognises, read=_read)
