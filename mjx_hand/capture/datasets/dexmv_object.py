"""The object of a DexMV recording: its poses beside the hand's, and its mesh.

A recording's folder holds the hand's `.npz` (see `dexmv`), in it `object_pose_objcam` (T, 3, 4), the object's pose in a
second camera, and `hand_cam_to_object_cam` (4, 4), which brings the hand's camera there; and one `.stl`, the object's
mesh in metres in the frame of these poses. Both cameras run at `dexmv.FPS`.
"""

import dataclasses
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.npz_archive import open_archive
from mjx_hand.objects.mesh_file import read_mesh

_LAYOUT: dict[str, tuple[int | str, ...]] = {"object_pose_objcam": ("t", 3, 4), "hand_cam_to_object_cam": (4, 4)}
_WORST = 1e6  # condition of a movement's matrix; with metres beside cosines it is below a hundred


@dataclasses.dataclass(frozen=True)
class RecordedObject:
    """An object's poses in the frame of the hand's recording, and its mesh; metres.

    Attributes:
        rotation, position: camera from object, a row a frame.
        vertices, faces: the mesh in the object's frame.
    """

    rotation: Float[np.ndarray, "t 3 3"]
    position: Float[np.ndarray, "t 3"]
    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]


def recording_files(folder: str | Path) -> tuple[Path, Path]:
    """The `.npz` and the `.stl` of a recording's folder.

    Raises:
        InputError: there is no such folder, or it does not hold one of each.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(
            f"{folder}: no such folder; give the folder of a DexMV recording, with its .npz and a mesh, .stl"
        )
    found = []
    for ending in ("npz", "stl"):
        files = sorted(file for file in folder.iterdir() if file.suffix.lower() == f".{ending}")
        if len(files) != 1:
            raise InputError(f"{folder}: holds {len(files)} .{ending} files; a recording has one .npz and one .stl")
        found.append(files[0])
    return found[0], found[1]


def load_object(recording: str | Path, mesh: str | Path) -> RecordedObject:
    """Read the object of a recording.

    Args:
        recording: the `.npz`.
        mesh: the `.stl`.

    Raises:
        InputError: a file is missing or damaged, or holds no object.
    """
    n = numbers(recording, open_archive(recording), _LAYOUT)
    to_object = n["hand_cam_to_object_cam"].astype(float)
    if not np.isfinite(np.linalg.cond(to_object)) or np.linalg.cond(to_object) > _WORST:
        raise InputError(f"{recording}: hand_cam_to_object_cam is no movement of a camera; copy the recording again")
    to_hand = np.linalg.inv(to_object)
    pose = np.einsum("ij,tjk->tik", to_hand[:3, :3], n["object_pose_objcam"].astype(float))
    pose[:, :, 3] += to_hand[:3, 3]
    vertices, faces = read_mesh(mesh)
    return RecordedObject(rotation=pose[:, :, :3], position=pose[:, :, 3], vertices=vertices, faces=faces)
