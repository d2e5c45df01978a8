"""OakInk2 (Zhan et al., CVPR 2024, https://oakink.net/v2): `anno_preview/SEQUENCE.pkl`.

Layout: https://github.com/oakink/OakInk2 (README.md; oakink2_preview/launch/viz/seg_3d.py for how the hand is made). A
pickled dictionary with PyTorch tensors, read without PyTorch:

- `raw_mano`: of each capture frame, by its number, `{rh,lh}__pose_coeffs` (1, 16, 4), quaternions wxyz of the wrist and
  MANO's 15 joints about the flat hand; `{rh,lh}__tsl` (1, 3), metres; `{rh,lh}__betas` (1, 10).
- `mocap_frame_id_list`: the numbers, which count 120 frames per second. Numbers left out are gaps.

The hand is made with its wrist joint at the origin (`center_idx=0`) and then moved: `tsl` is the wrist joint. Poses are
in the world frame of the capture system; `cam_extr`, objects and the body are not read. No licensed file is needed for
the pose; with one, the subject's joint centres come along.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import LONGEST, chosen_side, mano_motion, recorded, some
from mjx_hand.capture.datasets.subject import one_shape, subject_of
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import plain
from mjx_hand.motion import Motion

CAPTURE_FPS = 120.0
_KEYS = {"right": "rh", "left": "lh"}
_LAYOUT = {"pose_coeffs": (1, 16, 4), "tsl": (1, 3), "betas": (1, 10)}


def _recognises(path: Path, contents: Contents) -> bool:
    return "raw_mano" in contents and "mocap_frame_id_list" in contents


def _frame(path: Path, number: int, hand: str, frame: dict[str, Any]) -> Float[np.ndarray, "77"]:
    """A frame's quaternions, translation and coefficients in a row; NaN where the hand is not in it."""
    if f"{hand}__pose_coeffs" not in frame:
        return np.full(77, np.nan)
    named = {name: frame[f"{hand}__{name}"] for name in _LAYOUT if f"{hand}__{name}" in frame}
    found = {name: plain(path, f"{hand}__{name} of frame {number}", value) for name, value in named.items()}
    values = numbers(f"{path}: frame {number}", found, _LAYOUT, finite=False)
    return np.concatenate([value.ravel().astype(float) for value in values.values()])


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    frames = contents["raw_mano"]
    if not isinstance(frames, dict) or not all(isinstance(frame, dict) for frame in frames.values()):
        raise InputError(f"{path}: raw_mano is not a dictionary of frames; expected OakInk2's own annotation file")
    present = [side for side, hand in _KEYS.items() if any(f"{hand}__pose_coeffs" in f for f in frames.values())]
    side = chosen_side(path, present, request)
    listed = plain(path, "mocap_frame_id_list", contents["mocap_frame_id_list"])
    ids = numbers(path, {"mocap_frame_id_list": listed}, {"mocap_frame_id_list": ("t",)})["mocap_frame_id_list"]
    ids = ids.astype(int)
    steps = np.diff(ids)
    if len(ids) == 0 or (steps <= 0).any() or not set(ids.tolist()) <= frames.keys():
        raise InputError(f"{path}: mocap_frame_id_list is not a rising list of raw_mano's frames; get the file again")
    step = int(np.gcd.reduce(steps)) if len(steps) else 1
    length = (ids[-1] - ids[0]) // step + 1
    if length > LONGEST:
        raise InputError(f"{path}: mocap_frame_id_list spans {length} frames, over {LONGEST}; get the file again")

    values = np.full((length, 77), np.nan)
    for number in ids.tolist():
        values[(number - ids[0]) // step] = _frame(path, number, _KEYS[side], frames[number])
    quaternions = values[:, :64].reshape(-1, 16, 4)
    valid = some(path, recorded(path, values) & (np.linalg.norm(quaternions, axis=-1) > 0.5).all(axis=1))
    known = np.where(valid[:, None, None], quaternions, [1.0, 0, 0, 0]).reshape(-1, 4)
    rotations = Rotation.from_quat(known, scalar_first=True).as_matrix().reshape(-1, 16, 3, 3)
    return mano_motion(
        path,
        orientation=rotations[:, 0],
        rotations=rotations[:, 1:],
        wrist=values[:, 64:67],
        wrist_known=True,
        valid=valid,
        subject=subject_of(request, side, one_shape(values[:, 67:], valid)),
        fps=CAPTURE_FPS / step,
        side=side,
        source=f"OakInk2 {path.stem}",
    )


FORMAT = DatasetFormat(name="OakInk2 (.pkl with raw_mano and mocap_frame_id_list)", recognises=_recognises, read=_read)
