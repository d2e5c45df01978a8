"""The object of a DexMV recording: its poses beside the hand's, and its mesh.

A recording's folder holds the hand's `.npz` (see `dexmv`), in it `object_pose_objcam` (T, 3, 4), the object's pose in a
second camera, and `hand_cam_to_object_cam` (4, 4), which brings the hand's camera there; and one `.stl`, the object's
mesh in metres in the frame of these poses. Both cameras run at `dexmv.FPS`; the second may have some frames more.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.object_poses.with_mesh import object_with_mesh
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.motion import RecordedObject

_LAYOUT: dict[str, tuple[int | str, ...]] = {"object_pose_objcam": ("t", 3, 4), "hand_cam_to_object_cam": (4, 4)}
_FEW_DIGITS = 0.05


def dexmv_objects(path: Path, arrays: Mapping[str, Any], frames: int) -> tuple[RecordedObject, ...]:
    """The object in the hand's frames, named as its mesh; none where the recording has no object.

    Args:
        path: of the recording's `.npz`.
        arrays: in it.
        frames: of the hand; more poses are left out.

    Raises:
        InputError: the poses are not sound or fewer than the hand's, or the folder holds several meshes.
    """
    if not set(_LAYOUT) & set(arrays):
        return ()
    n = numbers(path, arrays, _LAYOUT, finite=False)
    to_camera = n["hand_cam_to_object_cam"].astype(float)
    if not np.abs(to_camera[:3, :3] @ to_camera[:3, :3].T - np.eye(3)).max() < _FEW_DIGITS:
        raise InputError(f"{path}: hand_cam_to_object_cam is not a rigid transform; get the file again")
    pose = np.tile(np.eye(4), (len(n["object_pose_objcam"]), 1, 1))
    pose[:, :3] = n["object_pose_objcam"]
    if len(pose) < frames:
        raise InputError(f"{path}: has {len(pose)} poses of the object for {frames} frames; get the file again")
    meshes = sorted(file for file in path.absolute().parent.iterdir() if file.suffix.lower() == ".stl")
    if len(meshes) > 1:
        raise InputError(f"{path.absolute().parent}: holds {len(meshes)} .stl files; keep the recording's object alone")
    mesh = meshes[0] if meshes else None
    pose = np.linalg.inv(_rigid(to_camera[None])) @ _rigid(pose[:frames])
    return (object_with_mesh("object" if mesh is None else mesh.stem, pose, mesh),)


def _rigid(pose: Float[np.ndarray, "t 4 4"]) -> Float[np.ndarray, "t 4 4"]:
    """The nearest rigid transforms, where they are near: cameras and poses are written with few digits."""
    known = np.isfinite(pose).all(axis=(1, 2))
    out = pose.copy()
    u, size, vt = np.linalg.svd(pose[known, :3, :3])
    near = np.abs(size - 1).max(axis=1, initial=0.0) < _FEW_DIGITS
    out[known, :3, :3] = np.where(near[:, None, None], u @ vt, pose[known, :3, :3])
    return out
