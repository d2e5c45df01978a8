"""DexMV hand recordings (Qin et al., ECCV 2022, https://yzqin.github.io/dexmv), as one `.npz` a sequence.

Metres and radians, in the camera's frame (about x right, y down, z forward), one right hand:

- `mano` (T, 61): 16 axis-angles about the *flat* hand (root, index, middle, pinky, ring, thumb, three joints each),
  ten shape coefficients, and the wrist joint's position.
- `joint_transforms` (T, 16, 4, 4): each joint's frame in the camera's frame, in the order that
  `joint_transform_order` names.
- `joints` (T, 21, 3), where present: joints and finger tips in the order that `joint_order` names.

The transforms carry the subject's own joint centres, so no licensed MANO file is needed. Shape and bone lengths were
estimated frame by frame and jitter; one hand has one of each, so they are medians over the frames. The object, where
the recording has one, is `dexmv_object`'s.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.joint_places import offsets_in_parents
from mjx_hand.capture.datasets.mano_motion import hands_of, refuse_wild
from mjx_hand.capture.object_poses.dexmv_object import dexmv_objects
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.hand.joints import FINGERS, LINKS, PARENTS, TIP_LINKS
from mjx_hand.motion import Motion, RecordedScene, check_motion, make_scene
from mjx_hand.motion.resample import matrix_quaternions

FPS = 25.0  # of every published sequence; the files do not say
_NEEDED = ("mano", "joint_transforms", "joint_transform_order")
# Pose and transforms are two accounts of the same rotations, equal to rounding where the joint order is understood.
_AGREEMENT = 1e-3


def _recognises(path: Path, arrays: Contents) -> bool:
    return all(name in arrays for name in _NEEDED)


def link_offsets_by_frame(transforms: Float[np.ndarray, "t 16 4 4"]) -> Float[np.ndarray, "t 16 3"]:
    """Each joint's centre in its parent's frame (m), from global transforms in the order of `LINKS`; wrist zero."""
    return offsets_in_parents(transforms[..., :3, :3], transforms[..., :3, 3])


def ordered_transforms(path: Path, arrays: Contents) -> Float[np.ndarray, "t 16 4 4"]:
    """The joints' global transforms in the order of `LINKS`.

    Raises:
        InputError: their shape or the joints' names are not DexMV's.
    """
    names = [str(name) for name in np.atleast_1d(arrays["joint_transform_order"])]
    if sorted(names) != sorted(LINKS):
        raise InputError(f"{path}: joint_transform_order names {', '.join(names)}; expected {', '.join(LINKS)}")
    transforms = numbers(path, arrays, {"joint_transforms": ("t", len(LINKS), 4, 4)}, finite=False)["joint_transforms"]
    return transforms[:, [names.index(link) for link in LINKS]].astype(float)


def tip_offsets(
    path: Path, arrays: Contents, transforms: Float[np.ndarray, "t 16 4 4"], valid: Bool[np.ndarray, "t"]
) -> Float[np.ndarray, "5 3"] | None:
    """The subject's finger tips in the last joints' frames (m), medians over the frames; None where not recorded.

    Raises:
        InputError: the file has `joints` that are not DexMV's.
    """
    if "joints" not in arrays or "joint_order" not in arrays:
        return None
    names = [str(name) for name in np.atleast_1d(arrays["joint_order"])]
    tips = [f"{finger}_tip" for finger in FINGERS]
    if not set(tips) <= set(names):
        raise InputError(f"{path}: joint_order names {', '.join(names)}; expected {', '.join(tips)} among them")
    joints = numbers(path, arrays, {"joints": (len(transforms), len(names), 3)}, finite=False)["joints"]
    places = joints[:, [names.index(tip) for tip in tips]].astype(float)
    valid = valid & np.isfinite(places).all(axis=(1, 2))
    if not valid.any():
        return None
    last = transforms[valid][:, list(TIP_LINKS)]
    return np.median(np.einsum("tfji,tfj->tfi", last[..., :3, :3], places[valid] - last[..., :3, 3]), axis=0)


def _read(path: Path, arrays: Contents, request: Request) -> Motion:
    transforms = ordered_transforms(path, arrays)
    frames = len(transforms)
    mano = numbers(path, arrays, {"mano": (frames, 61)}, finite=False)["mano"].astype(float)
    values = np.concatenate([mano, transforms.reshape(frames, len(LINKS) * 16)], axis=1)
    refuse_wild(path, values)
    valid = np.asarray(np.isfinite(values).all(axis=1))
    if not valid.any():
        raise InputError(f"{path}: none of its {frames} frames is finite; nothing to read")

    pose = np.where(valid[:, None], mano[:, :48], 0.0).reshape(-1, 3)
    rotations = Rotation.from_rotvec(pose).as_matrix().reshape(frames, 16, 3, 3)
    seen = transforms[valid]
    in_parent = np.swapaxes(seen[:, list(PARENTS[1:])], -1, -2)[..., :3, :3] @ seen[:, 1:, :3, :3]
    gap = np.abs(in_parent - rotations[valid, 1:]).max()
    if gap > _AGREEMENT:
        raise InputError(
            f"{path}: pose and joint_transforms differ by up to {gap:.2g} in a matrix entry; "
            "expected 48 axis-angle values about the flat hand (root, index, middle, pinky, ring, thumb)"
        )
    return check_motion(
        Motion(
            fps=FPS,
            rotations=rotations[:, 1:],
            wrist_position=np.where(valid[:, None], transforms[:, 0, :3, 3], 0.0),
            wrist_quaternion=matrix_quaternions(rotations[:, 0]),
            shape=np.median(mano[valid, 48:58], axis=0),
            valid=valid,
            link_offset=np.median(link_offsets_by_frame(seen), axis=0),
            tip_offset=tip_offsets(path, arrays, transforms, valid),
            side="right",
            source=f"DexMV {path.name}",
        ),
        name=str(path),
    )


def _read_scene(path: Path, arrays: Contents, request: Request) -> RecordedScene:
    (hand,) = hands_of(_read, path, arrays, request, ["right"])
    return make_scene(hand, dexmv_objects(path, arrays, hand.num_frames))


FORMAT = DatasetFormat(
    name=f"DexMV (.npz with {', '.join(_NEEDED)})",
    recognises=_recognises,
    read=_read,
    read_scene=_read_scene,
)
