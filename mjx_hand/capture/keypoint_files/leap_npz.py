"""Leap Motion hands as arrays: `t` (s) and for each hand that was followed `{side}_{id}_joints_mm` (T, 5, 4, 3).

Fingers thumb to little, joints mcp, pip, dip, tip, millimetres in the device's frame; `{side}_{id}_frame` (T,) are the
rows of `t` in which this hand was seen. Hands of one side that never are there at once are one, which was lost and
found again under another id. The joints are those of leap.js (`mcpPosition` … `tipPosition`,
https://github.com/leapmotion/leapjs), whose thumb has its CMC at `mcp`.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.reader import ARRAYS, KeypointReader
from mjx_hand.capture.keypoint_frames.one_hand import found_again, name_of, never_at_once, with_parts
from mjx_hand.capture.keypoint_frames.timed_hand import timed_hand
from mjx_hand.capture.keypoints.layouts import LAYOUTS, to_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.size import unit_factor
from mjx_hand.capture.timeline.compare_clocks import timeline_of
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers

_JOINTS = re.compile(r"(right|left)_(\w+)_joints_mm")


def _recognises(arrays: Any) -> bool:
    return "t" in arrays and any(_JOINTS.fullmatch(str(name)) for name in arrays)


def _read(path: Path, arrays: Any, unit: str | None) -> dict[str, KeypointRecording]:
    times = numbers(path, arrays, {"t": ("t",)})["t"]
    sides, joints, rows, seen = {}, {}, {}, {}
    for match in filter(None, map(_JOINTS.fullmatch, map(str, arrays))):
        name = f"{match[1]}_{match[2]}"
        n = numbers(path, arrays, {match[0]: ("t", 5, 4, 3), f"{name}_frame": ("t",)}, finite=False)
        sides[name], joints[name], rows[name] = match[1], n[match[0]].astype(float), n[f"{name}_frame"].astype(int)
        if not len(rows[name]) or rows[name].min() < 0 or rows[name].max() >= len(times):
            raise InputError(f"{path}: {name}_frame names frames beyond the {len(times)} of t; they count from 0")
        seen[name] = np.isin(np.arange(len(times)), rows[name])
    found = {}
    for group in with_parts(never_at_once(seen, sides)):
        name = name_of(group)
        at = np.concatenate([rows[each] for each in group])
        points = np.concatenate([joints[each] for each in group])
        points = np.where(np.isfinite(points), points, np.nan) * unit_factor(str(path), unit or "mm")
        order = np.argsort(at, kind="stable")
        found[name] = timed_hand(
            path,
            to_keypoints(points[order].reshape(-1, 20, 3), LAYOUTS["leap"]),
            timeline_of(path, len(at), times=times[at[order]], name="t"),
            side=sides[group[0]],
            layout="leap",
            source=f"{path.name} {name}",
            warnings=found_again(group),
        )
    return found


READER = KeypointReader(
    name="Leap Motion arrays (`t`, `right_ID_joints_mm`)", container=ARRAYS, recognises=_recognises, read=_read
)
