"""Leap Motion hands as arrays: `t` (s) and for each hand that was followed `{side}_{id}_joints_mm` (T, 5, 4, 3).

Fingers thumb to little, joints mcp, pip, dip, tip, millimetres in the device's frame; `{side}_{id}_frame` (T,) are the
rows of `t` in which this hand was seen. The joints are those of leap.js (`mcpPosition` … `tipPosition`,
https://github.com/leapmotion/leapjs), whose thumb has its CMC at `mcp`.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoint_files.reader import KeypointReader
from mjx_hand.capture.keypoint_files.timed_hand import timed_hand
from mjx_hand.capture.keypoints.layouts import LAYOUTS, to_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.size import unit_factor
from mjx_hand.capture.timeline.compare_clocks import timeline_of
from mjx_hand.files.checked_arrays import numbers

_JOINTS = re.compile(r"(right|left)_(\w+)_joints_mm")


def _recognises(arrays: Any) -> bool:
    return "t" in arrays and any(_JOINTS.fullmatch(name) for name in arrays)


def _read(path: Path, arrays: Any, unit: str | None) -> dict[str, KeypointRecording]:
    times = numbers(path, arrays, {"t": ("t",)})["t"]
    found = {}
    for match in filter(None, map(_JOINTS.fullmatch, arrays)):
        side, hand = match.groups()
        name = f"{side}_{hand}"
        n = numbers(path, arrays, {match[0]: ("t", 5, 4, 3), f"{name}_frame": ("t",)}, finite=False)
        joints, rows = n[match[0]].astype(float), n[f"{name}_frame"].astype(int)
        joints = np.where(np.isfinite(joints), joints, np.nan) * unit_factor(str(path), unit or "mm")
        timeline = timeline_of(path, len(rows), times=times[rows], name="t")
        positions = to_keypoints(joints.reshape(len(joints), 20, 3), LAYOUTS["leap"])
        found[name] = timed_hand(path, positions, timeline, side=side, layout="leap", source=f"{path.name} {name}")
    return found


READER = KeypointReader(
    name="Leap Motion arrays (`t`, `right_ID_joints_mm`)", suffix=".npz", recognises=_recognises, read=_read
)
