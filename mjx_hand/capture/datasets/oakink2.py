"""OakInk2 (Zhan et al., CVPR 2024, https://oakink.net/v2): `anno_preview/SEQUENCE.pkl`.

Layout: https://github.com/oakink/OakInk2 (README.md; oakink2_preview/launch/viz/seg_3d.py for how the hand is made,
oakink2_toolkit/dataset.py for the objects). A pickled dictionary with PyTorch tensors, read without PyTorch:

- `raw_mano`: of each capture frame, by its number, `{rh,lh}__pose_coeffs` (1, 16, 4), quaternions wxyz of the wrist and
  MANO's 15 joints about the flat hand; `{rh,lh}__tsl` (1, 3), metres; `{rh,lh}__betas` (1, 10).
- `mocap_frame_id_list`: the numbers, which count 120 frames per second. Numbers left out are gaps.
- `obj_list`, the objects or parts of them; `obj_transf`, of each by frame a matrix (4, 4), world from object, metres.
  A part that moves on its own is an object of its own; frames without its matrix are gaps.

The hand is made with its wrist joint at the origin (`center_idx=0`) and then moved: `tsl` is the wrist joint. Poses are
in the world frame of the capture system; `cam_extr` and the body are not read. No licensed file is needed for the pose;
with one, the subject's joint centres come along. The toolkit does not say where up is: +y, as whoever simulates these
recordings takes it (https://github.com/ManipTrans/ManipTrans); that could not be checked on a recording.

Meshes (m): the one `.obj` or `.ply` in `../object_repair/align_ds/ID`, else in `../object_raw`, or in
`../object_preview`, as an older release calls it. Their `obj_desc.json` names the objects.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mjx_hand.capture.dataset_files.dataset_root import beside, one_name
from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import (
    LONGEST,
    chosen_side,
    hands_of,
    mano_motion,
    recorded,
    refuse_wild,
    some,
)
from mjx_hand.capture.datasets.subject import one_shape, subject_of
from mjx_hand.capture.object_poses.with_mesh import object_with_mesh
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import plain, unwrapped
from mjx_hand.files.json_text import read_json
from mjx_hand.motion import Motion, RecordedObject, RecordedScene, make_scene

CAPTURE_FPS = 120.0
UP = "+y"
_KEYS = {"right": "rh", "left": "lh"}
_LAYOUT = {"pose_coeffs": (1, 16, 4), "tsl": (1, 3), "betas": (1, 10)}
_FOLDERS = ("object_repair", "object_raw", "object_preview")
_MESHES = (".obj", ".ply")


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


def _frames(path: Path, contents: Contents) -> dict[Any, Any]:
    """What `raw_mano` holds, by frame."""
    frames = contents["raw_mano"]
    if not isinstance(frames, dict) or not all(isinstance(frame, dict) for frame in frames.values()):
        raise InputError(f"{path}: raw_mano is not a dictionary of frames; expected OakInk2's own annotation file")
    return frames


def _present(frames: dict[Any, Any]) -> list[str]:
    return [side for side, hand in _KEYS.items() if any(f"{hand}__pose_coeffs" in f for f in frames.values())]


def _clock(path: Path, contents: Contents) -> tuple[dict[int, int], int, float]:
    """The place of each numbered frame in time, how many places there are, and their rate."""
    listed = plain(path, "mocap_frame_id_list", contents["mocap_frame_id_list"])
    ids = numbers(path, {"mocap_frame_id_list": listed}, {"mocap_frame_id_list": ("t",)})["mocap_frame_id_list"]
    ids = ids.astype(int)
    steps = np.diff(ids)
    if len(ids) == 0 or (steps <= 0).any() or not set(ids.tolist()) <= _frames(path, contents).keys():
        raise InputError(f"{path}: mocap_frame_id_list is not a rising list of raw_mano's frames; get the file again")
    step = int(np.gcd.reduce(steps)) if len(steps) else 1
    length = int((ids[-1] - ids[0]) // step + 1)
    if length > LONGEST:
        raise InputError(f"{path}: mocap_frame_id_list spans {length} frames, over {LONGEST}; get the file again")
    return {number: int((number - ids[0]) // step) for number in ids.tolist()}, length, CAPTURE_FPS / step


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    frames = _frames(path, contents)
    side = chosen_side(path, _present(frames), request)
    places, length, fps = _clock(path, contents)
    values = np.full((length, 77), np.nan)
    for number, place in places.items():
        values[place] = _frame(path, number, _KEYS[side], frames[number])
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
        fps=fps,
        side=side,
        source=f"OakInk2 {path.stem}",
    )


def _objects(path: Path, contents: Contents) -> tuple[RecordedObject, ...]:
    """The objects of `obj_list` that have a pose in any frame."""
    poses = unwrapped(contents.get("obj_transf", {}))
    if not isinstance(poses, dict) or not all(isinstance(own, dict) for own in poses.values()):
        raise InputError(f"{path}: obj_transf is not a dictionary of objects and their frames; get the file again")
    listed = unwrapped(contents.get("obj_list", list(poses)))
    if not isinstance(listed, list):
        raise InputError(f"{path}: obj_list is not a list of objects; get the file again")
    ids = [each for each in dict.fromkeys(one_name(path, "obj_list", each) for each in listed) if each in poses]
    places, length, _ = _clock(path, contents)
    names = _names(path)
    called = [names.get(each, each) for each in ids]
    found = []
    for each, name in zip(ids, called, strict=True):
        matrices = _matrices(path, each, poses[each], places, length)
        if np.isfinite(matrices).any():
            found.append(object_with_mesh(name if called.count(name) == 1 else each, matrices, _mesh(path, each)))
    return tuple(found)


def _matrices(
    path: Path, name: str, own: dict[Any, Any], places: dict[int, int], length: int
) -> Float[np.ndarray, "t 4 4"]:
    """An object's poses; NaN in the frames without one."""
    matrices = np.full((length, 4, 4), np.nan)
    for number, place in places.items():
        if own.get(number) is not None:
            value = {name: plain(path, f"obj_transf {name} of frame {number}", own[number])}
            matrices[place] = numbers(f"{path}: frame {number}", value, {name: (4, 4)}, finite=False)[name]
    refuse_wild(path, matrices)
    matrices[~np.isfinite(matrices).all(axis=(1, 2)) | (matrices[:, :3, :3] == 0).all(axis=(1, 2))] = np.nan
    return matrices


def _mesh(path: Path, name: str) -> Path | None:
    folders = [beside(path, 2, f"{folder}/align_ds/{name}") for folder in _FOLDERS]
    files = [file for folder in folders if folder.is_dir() for file in sorted(folder.iterdir())]
    return next((file for file in files if file.suffix.lower() in _MESHES), None)


def _names(path: Path) -> dict[str, str]:
    """What the objects are called, where the data set's list is there."""
    lists = [beside(path, 2, f"{folder}/obj_desc.json") for folder in _FOLDERS]
    file = next((each for each in lists if each.is_file()), None)
    if file is None:
        return {}
    try:
        return {each: str(about["obj_name"]) for each, about in read_json(file).items()}
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{file}: not OakInk2's list of objects ({type(error).__name__}); get it again") from None


def _read_scene(path: Path, contents: Contents, request: Request) -> RecordedScene:
    hands = hands_of(_read, path, contents, request, _present(_frames(path, contents)))
    return make_scene(hands, _objects(path, contents), up=UP, source=f"OakInk2 {path.stem}")


FORMAT = DatasetFormat(
    name="OakInk2 (.pkl with raw_mano and mocap_frame_id_list)",
    recognises=_recognises,
    read=_read,
    read_scene=_read_scene,
)
