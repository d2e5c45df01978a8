"""HaMeR and WiLoR: MANO parameters that a network estimated from the images of a video.

HaMeR (Pavlakos et al., CVPR 2024, https://github.com/geopavlakos/hamer), WiLoR (Potamias et al., CVPR 2025,
https://github.com/rolpotamias/WiLoR) and WiLoR-mini (https://github.com/warmshao/WiLoR-mini). Their demos save meshes
and pictures only; what is read is their models' output as it stands, saved an image a file (`.npz`, `.npy`, `.pkl`) in
one folder, or as a pickled list with one entry an image. Numbers that end the files' names count the frames; numbers
left out, and images without the hand, are gaps. An image's entry is either

- HaMeR's and WiLoR's dictionary: `pred_mano_params` (or its contents themselves) with `global_orient` (B, 1, 3, 3),
  `hand_pose` (B, 15, 3, 3) and `betas` (B, 10) of B hands; `pred_cam_t_full` (B, 3), metres; `right` (B,), 1 or 0;
  `pred_keypoints_3d` (B, 21, 3), which may be left out. Everything is of a *right* hand: the model sees left hands
  mirrored (x to -x), and so does this dictionary; or
- WiLoR-mini's list of hands: `is_right` and `wilor_preds` with the same names, `global_orient` and `hand_pose` as
  axis-angles (1, n, 3), and left hands mirrored back already.

Rotations are about the flat hand (https://github.com/geopavlakos/hamer/issues/26), in the camera's frame (x right,
y down, z forward). The camera is a guess of the network's: depth, and with it size, is to a scale. The wrist is
`pred_cam_t_full` plus the resting place of the wrist, the first of `pred_keypoints_3d`; without keypoints, the licensed
file's or the open hand's. Shape is estimated anew in each image: one hand has one, so it is the median over the frames,
as are the bones. The frame rate is the video's: give `fps`.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mjx_hand.capture.datasets.contents import PICKLES, WHOLE, plain, read_contents, unwrapped
from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.joint_places import subject_with_joints
from mjx_hand.capture.datasets.mano_motion import LONGEST, chosen_side, frame_rate, mano_motion, recorded, some
from mjx_hand.capture.datasets.subject import one_shape, subject_of
from mjx_hand.errors import InputError
from mjx_hand.motion import Motion
from mjx_hand.motion.layout import numbers

Array = np.ndarray
_PARAMETERS = ("global_orient", "hand_pose", "betas")
_MIRROR = np.diag([-1.0, 1, 1])


@dataclass(frozen=True)
class _Hand:
    """One hand in one image: its own rotations (wrist first), shape, translation, and joints (NaN if not there)."""

    side: str
    rotations: Float[Array, "16 3 3"]
    shape: Float[Array, "10"]
    translation: Float[Array, "3"]
    joints: Float[Array, "21 3"]

    def row(self) -> Float[Array, "220"]:
        return np.concatenate([self.rotations.ravel(), self.shape, self.translation, self.joints.ravel()])


def _parameters(entry: Any) -> dict[str, Any]:
    """The named values of HaMeR's dictionary, its parameters among them; nothing where it is none."""
    if not isinstance(entry, dict):
        return {}
    inner = unwrapped(entry.get("pred_mano_params"))
    values = {**entry, **inner} if isinstance(inner, dict) else entry
    return values if all(name in values for name in _PARAMETERS) else {}


def _is_mini(entry: Any) -> bool:
    return isinstance(entry, list) and bool(entry) and all(isinstance(e, dict) and "is_right" in e for e in entry)


def _hands(where: str, entry: Any) -> list[_Hand]:
    """The hands in an image's entry."""
    entry = unwrapped(entry)
    if entry is None or (isinstance(entry, list) and not entry):
        return []
    if _is_mini(entry):
        seen = [e for e in entry if isinstance(e.get("wilor_preds"), dict)]
        return [hand for e in seen for hand in _mini(where, e)]
    values = _parameters(entry)
    if not values:
        raise InputError(f"{where}: holds no {', '.join(_PARAMETERS)}; save the model's own output")
    right = plain(where, "right", values.get("right", values.get("is_right")))
    count = right.size
    right = numbers(where, {"right": right.reshape(count)}, {"right": (count,)})["right"]
    found = _found(where, values)
    layout = {"global_orient": (count, 1, 3, 3), "hand_pose": (count, 15, 3, 3)}
    rotations = np.concatenate(list(numbers(where, found, layout, finite=False).values()), axis=1).astype(float)
    mirror = np.where(right.reshape(-1, 1, 1) > 0.5, np.eye(3), _MIRROR)
    rotations = mirror[:, None] @ rotations @ mirror[:, None]
    return _made(where, found, right, rotations, mirror)


def _mini(where: str, entry: dict[str, Any]) -> list[_Hand]:
    right = plain(where, "is_right", entry["is_right"])
    if right.size != 1 or right.dtype.kind not in "fiub":
        raise InputError(f"{where}: is_right is no single number")
    found = _found(where, entry["wilor_preds"])
    layout = {"global_orient": (1, 1, 3), "hand_pose": (1, 15, 3)}
    vectors = np.concatenate(list(numbers(where, found, layout, finite=False).values()), axis=1).astype(float)
    finite = np.isfinite(vectors).all()
    rotations = Rotation.from_rotvec(vectors[0]).as_matrix() if finite else np.full((16, 3, 3), np.nan)
    return _made(where, found, right, rotations[None], np.eye(3)[None])


def _found(where: str, values: dict[str, Any]) -> dict[str, Array]:
    names = (*_PARAMETERS, "pred_cam_t_full", "pred_keypoints_3d")
    found = {name: plain(where, name, values[name]) for name in names if name in values}
    if "pred_cam_t_full" not in found:
        raise InputError(f"{where}: has no pred_cam_t_full; save it too (pred_cam_t is of the crop, not of the image)")
    return found


def _made(where: str, found: dict[str, Array], right: Array, rotations: Array, mirror: Array) -> list[_Hand]:
    count = len(rotations)
    values = numbers(where, found, {"betas": (count, 10), "pred_cam_t_full": (count, 3)}, finite=False)
    joints = np.full((count, 21, 3), np.nan)
    if "pred_keypoints_3d" in found:
        joints = (
            numbers(where, found, {"pred_keypoints_3d": (count, 21, 3)}, finite=False)["pred_keypoints_3d"] @ mirror
        )
    given = rotations[np.isfinite(rotations).all(axis=(1, 2, 3))]
    off = np.abs(given @ np.swapaxes(given, -1, -2) - np.eye(3)).max(initial=0)
    if off > 0.01 or (np.linalg.det(given) < 0).any():  # half precision is off by 0.002
        raise InputError(f"{where}: global_orient or hand_pose holds matrices that are not rotations")
    return [
        _Hand(
            side="right" if right.ravel()[k] > 0.5 else "left",
            rotations=rotations[k],
            shape=values["betas"][k].astype(float),
            translation=values["pred_cam_t_full"][k].astype(float),
            joints=joints[k].astype(float),
        )
        for k in range(count)
    ]


def _files(path: Path) -> list[tuple[int | None, Path]]:
    """The files in a folder that may hold an image's output, each with the number that ends its name."""
    files = sorted(file for file in path.iterdir() if file.suffix in (".npz", ".npy", *PICKLES))
    ends = [re.search(r"[0-9]+$", file.stem) for file in files]
    return [(int(end.group()) if end else None, file) for end, file in zip(ends, files, strict=True)]


def _entry(contents: Contents) -> Any:
    return contents.get(WHOLE, contents)


def _recognises(path: Path, contents: Contents) -> bool:
    if path.is_dir():
        files = _files(path)
        named = bool(files) and all(number is not None for number, _ in files)
        return named and _is_entry(_entry(read_contents(files[0][1])))
    entry = unwrapped(_entry(contents))
    if isinstance(entry, list) and not _is_mini(entry):
        return any(_is_entry(one) for one in entry)
    return _is_entry(entry)


def _is_entry(entry: Any) -> bool:
    entry = unwrapped(entry)
    return _is_mini(entry) or bool(_parameters(entry))


def _images(path: Path, contents: Contents) -> dict[int, list[_Hand]]:
    """The hands in each image, by its number."""
    if not path.is_dir():
        entry = unwrapped(_entry(contents))
        listed = entry if isinstance(entry, list) and not _is_mini(entry) else [entry]
        return {k: _hands(f"{path}: image {k}", one) for k, one in enumerate(listed)}
    files = {number: file for number, file in _files(path) if number is not None}
    if len(files) < len(_files(path)) or max(files) - min(files) > LONGEST:
        raise InputError(f"{path}: two files have one number, or numbers are wild; name them by image, as 000001.npz")
    return {number: _hands(str(file), _entry(read_contents(file))) for number, file in files.items()}


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    fps = frame_rate(path, request)
    images = _images(path, contents)
    present = [
        side for side in ("right", "left") if any(hand.side == side for hands in images.values() for hand in hands)
    ]
    side = chosen_side(path, present, request)
    rows = np.full((max(images) - min(images) + 1, 220), np.nan)
    for number, hands in images.items():
        own = [hand for hand in hands if hand.side == side]
        if len(own) > 1:
            raise InputError(f"{path}: image {number} has {len(own)} {side} hands; keep one person's")
        if own:
            rows[number - min(images)] = own[0].row()

    valid = some(path, recorded(path, rows[:, :157]))
    given = np.where(valid[:, None, None, None], rows[:, :144].reshape(-1, 16, 3, 3), np.eye(3))
    rotations = Rotation.from_matrix(given.reshape(-1, 3, 3)).as_matrix().reshape(given.shape)
    shape, joints = one_shape(rows[:, 144:154], valid), rows[:, 157:].reshape(-1, 21, 3)
    if np.isfinite(joints[valid]).all():
        subject = subject_with_joints(path, shape, rotations[:, 0], rotations[:, 1:], joints, valid)
        rest = joints[:, 0]
    else:
        subject = subject_of(request, side, shape, as_shipped=False)
        rest = subject.wrist
    return mano_motion(
        path,
        orientation=rotations[:, 0],
        rotations=rotations[:, 1:],
        wrist=rows[:, 154:157] + rest,
        valid=valid,
        subject=subject,
        fps=fps,
        side=side,
        source=f"HaMeR or WiLoR, {path.name}",
    )


FORMAT = DatasetFormat(
    name="HaMeR or WiLoR output (a folder of images' .npz or .pkl, or a .pkl list, with global_orient, hand_pose)",
    recognises=_recognises,
    read=_read,
)
