"""TACO (Liu et al., CVPR 2024, https://taco2024.github.io): a sequence's folder, `Hand_Poses/TRIPLET/SEQUENCE`.

Layout: https://github.com/leolyliu/TACO-Instructions (README.md; dataset_utils/hand_pose_loader.py for how the hand is
made, dataset_utils/visualization.py for the objects). Pickles with PyTorch tensors, read without PyTorch:

- `{right,left}_hand.pkl`: of each frame, in the order of the names, `hand_pose` (48,), axis-angles (rad) of the wrist
  and MANO's 15 joints, and `hand_trans` (3,), metres.
- `{right,left}_hand_shape.pkl`: `hand_shape`, ten coefficients; without the file zeros, as the dataset's tools have it.

The tools make the hand with `flat_hand_mean=True` (the default of their manopth), without components, and with its
wrist joint at the origin (`center_idx=0`, which counts since the layer is given no translation); `hand_trans` is added
then: it is the wrist joint. No licensed file is needed for the pose; with one, the subject's joint centres come along.
30 frames per second. Poses are in one world frame with z up, as the drawings of its axes in the repository
(assets/world_coordinate_system_visualizations) and the camera in visualization.py have it.

Objects: `../../../Object_Poses/TRIPLET/SEQUENCE/tool_NAME.npy` and `target_NAME.npy` (t, 4, 4), world from object,
metres, a matrix a frame of the hands. Meshes, in centimetres: `../../../Object_Models/NAME_cm.obj`, or in
`object_models_released`, as the tools call that folder. They are named as their files of poses, such as tool_051.
None of this could be checked on a recording. Cameras, images and segmentations are not read.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.dataset_files.dataset_root import beside
from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import chosen_side, hands_of, mano_motion, recorded, refuse_wild, turns
from mjx_hand.capture.datasets.subject import subject_of
from mjx_hand.capture.object_poses.with_mesh import object_with_mesh
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import WHOLE, plain, read_contents
from mjx_hand.motion import Motion, RecordedObject, RecordedScene, make_scene

FPS = 30.0
UP = "+z"
_LAYOUT = {"hand_pose": (48,), "hand_trans": (3,)}
_MODELS = ("Object_Models", "object_models_released")


def _file(path: Path, side: str) -> Path:
    return path / f"{side}_hand.pkl"


def _present(path: Path) -> list[str]:
    return [side for side in ("right", "left") if _file(path, side).is_file()]


def _recognises(path: Path, contents: Contents) -> bool:
    return bool(_present(path))


def _frames(file: Path) -> dict[int, dict[str, Any]]:
    """What the file says of each frame, by its number, in their order."""
    contents = read_contents(file)
    numbered = {int(name): frame for name, frame in contents.items() if str(name).isdecimal()}
    if not numbered or len(numbered) < len(contents) or not all(isinstance(each, dict) for each in numbered.values()):
        raise InputError(
            f"{file}: not a dictionary of frames, by number, with {' and '.join(_LAYOUT)}; get TACO's own file again"
        )
    missing = max(numbered) + 1 - min(numbered) - len(numbered)
    if missing:
        raise InputError(f"{file}: {missing} of the frames between its first and last are left out; get the file again")
    return dict(sorted(numbered.items()))


def _rows(file: Path, frames: dict[int, dict[str, Any]]) -> Float[np.ndarray, "t 51"]:
    """Pose and translation of each frame."""
    rows = np.zeros((len(frames), 51))
    for row, (name, frame) in zip(rows, frames.items(), strict=True):
        told = {key: plain(file, f"{key} of frame {name}", frame[key]) for key in _LAYOUT if key in frame}
        row[:] = np.concatenate(list(numbers(f"{file}: frame {name}", told, _LAYOUT, finite=False).values()))
    return rows


def _shape(file: Path) -> Float[np.ndarray, "10"]:
    if not file.is_file():
        return np.zeros(10)
    contents = read_contents(file)
    told = {name: plain(file, name, contents[name]).reshape(-1) for name in ("hand_shape",) if name in contents}
    return numbers(file, told, {"hand_shape": (10,)})["hand_shape"].astype(float)


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    side = chosen_side(path, _present(path), request)
    return _hand(path, {side: _frames(_file(path, side))}, request)


def _hand(path: Path, frames: Contents, request: Request) -> Motion:
    """The hand that the request names, of those whose frames are given by side."""
    side = chosen_side(path, list(frames), request)
    rows = _rows(_file(path, side), frames[side])
    valid = recorded(_file(path, side), rows)
    rotations = turns(rows[:, :48].reshape(-1, 16, 3), valid)
    return mano_motion(
        path,
        orientation=rotations[:, 0],
        rotations=rotations[:, 1:],
        wrist=rows[:, 48:],
        wrist_known=True,
        valid=valid,
        subject=subject_of(request, side, _shape(path / f"{side}_hand_shape.pkl")),
        fps=FPS,
        side=side,
        source=_source(path),
    )


def _source(path: Path) -> str:
    return f"TACO {path.absolute().parent.name}/{path.absolute().name}"


def _pose_files(path: Path) -> list[Path]:
    """The objects' files, by the folder's own name or by that of what it is a link to."""
    for own in (path.absolute(), path.resolve()):
        folder = beside(own, 3, f"Object_Poses/{own.parent.name}/{own.name}")
        if folder.is_dir():
            return [file for role in ("tool", "target") for file in sorted(folder.glob(f"{role}_*.npy"))]
    return []


def _objects(path: Path, frames: int) -> tuple[RecordedObject, ...]:
    found = []
    for file in _pose_files(path):
        whole = {"poses": plain(file, "poses", read_contents(file).get(WHOLE))}
        poses = numbers(file, whole, {"poses": (frames, 4, 4)}, finite=False)["poses"].astype(float)
        refuse_wild(file, poses)
        seen = np.isfinite(poses).all(axis=(1, 2)) & (poses[:, :3, :3] != 0).any(axis=(1, 2))
        poses[~seen] = np.eye(4)
        if seen.any():
            found.append(object_with_mesh(file.stem, poses, _mesh(path, file), unit="cm", seen=seen))
    return tuple(found)


def _mesh(path: Path, file: Path) -> Path | None:
    name = file.stem.rpartition("_")[2]
    places = [beside(path, 3, f"{folder}/{name}_cm.obj") for folder in _MODELS]
    return next((place for place in places if place.is_file()), None)


def _read_scene(path: Path, contents: Contents, request: Request) -> RecordedScene:
    frames = {side: _frames(_file(path, side)) for side in _present(path)}
    first = {side: min(own) for side, own in frames.items()}
    if len(set(first.values())) > 1:
        told = ", ".join(f"of the {side} hand with {number}" for side, number in first.items())
        raise InputError(f"{path}: frames begin {told}: these are of two recordings; get the folder again")
    hands = hands_of(_hand, path, frames, request, list(frames))
    return make_scene(hands, _objects(path, hands[0].num_frames), up=UP, source=_source(path))


FORMAT = DatasetFormat(
    name="TACO (a sequence's folder of Hand_Poses, with right_hand.pkl and left_hand.pkl)",
    recognises=_recognises,
    read=_read,
    read_scene=_read_scene,
)
