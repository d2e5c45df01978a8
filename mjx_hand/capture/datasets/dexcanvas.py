"""DexCanvas (Xu et al. 2025, arXiv 2510.15786, https://huggingface.co/datasets/DEXROBOT/DexCanvas): one trajectory.

The dataset is a table in Lance's form, a trajectory a row. Read here is a row that was taken out of it, as a pickle of
its dictionary (`{hands: [...], trajectory_metadata: {hand_names, mano_hand_shapes}}`), or one hand's fields as an
`.npz` (with `hand_name` and `shape`, if known). A hand's fields:

- `mano_global_pos` (T, 3), metres, and `mano_global_rot_aa` (T, 3), axis-angle (rad): of the whole hand in the world.
- `mano_hand_pose` (T, 48): axis-angles about the flat hand, first the wrist's own (zero in what was seen), then MANO's
  15 joints; or (T, 45) without the wrist's.
- `mano_joint_pos` (T, 21, 3) or (T, 63): joints before the global motion, wrist first, then thumb to little finger.
- `urdf_dof` (T, 26): the angles of the dataset's own robot hand; not read.

The dataset card names the fields and the capture rate, 100 frames per second; a row's `data_fps` says otherwise where
there is one. Conventions are those of a public viewer of the dataset: it makes the hand with `flat_hand_mean=True` from
all 48 values and then turns it *about the hand model's origin*, so the wrist is at `mano_global_pos` plus the turned
place of the resting wrist. That place is `mano_joint_pos`'s first joint; without these joints, the licensed file's or
the open hand's. None of this could be checked on a recording. Objects, contacts and video are not read.
"""

from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.joint_places import subject_with_joints
from mjx_hand.capture.datasets.mano_motion import chosen_side, mano_motion, recorded, turns
from mjx_hand.capture.datasets.subject import one_shape, subject_of
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import plain, unwrapped
from mjx_hand.motion import Motion

FPS = 100.0
_NEEDED = ("mano_global_pos", "mano_global_rot_aa", "mano_hand_pose")
_OTHERS = ("mano_joint_pos", "shape")


def _is_hand(fields: Any) -> bool:
    return isinstance(fields, dict) and all(name in fields for name in _NEEDED)


def _rows(contents: Contents) -> list[Any]:
    """The hands' fields: those of a row, or the contents themselves."""
    hands = unwrapped(contents.get("hands"))
    return hands if isinstance(hands, list) else [dict(contents)]


def _listed(path: Path, meta: dict[str, Any], name: str) -> list[Any]:
    """What the row says of each hand under that name; nothing where it does not."""
    value = unwrapped(meta.get(name))
    if value is None or isinstance(value, list | tuple):
        return list(value or ())
    return list(np.atleast_1d(plain(path, name, value)))


def _recognises(path: Path, contents: Contents) -> bool:
    return any(_is_hand(fields) for fields in _rows(contents))


def _hands(path: Path, contents: Contents, request: Request) -> dict[str, dict[str, Any]]:
    """The hands by side, each with its shape."""
    meta = unwrapped(contents.get("trajectory_metadata"))
    meta = meta if isinstance(meta, dict) else {}
    names, shapes = _listed(path, meta, "hand_names"), _listed(path, meta, "mano_hand_shapes")
    hands = {}
    for k, fields in enumerate(_rows(contents)):
        if not _is_hand(fields):
            continue  # an empty slot
        name = str(names[k] if k < len(names) else fields.get("hand_name") or request.side or "").lower()
        side = next((side for side in ("right", "left") if side in name), None)
        if side is None:
            raise InputError(f"{path}: does not say which hand it is; give side='right' or side='left'")
        hands[side] = fields | ({"shape": shapes[k]} if k < len(shapes) else {})
    return hands


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    hands = _hands(path, contents, request)
    side = chosen_side(path, list(hands), request)
    fields = {name: plain(path, name, hands[side][name]) for name in (*_NEEDED, *_OTHERS) if name in hands[side]}
    width = 45 if np.shape(fields["mano_hand_pose"])[-1:] == (45,) else 48
    layout = {"mano_global_pos": ("t", 3), "mano_global_rot_aa": ("t", 3), "mano_hand_pose": ("t", width)}
    values = numbers(path, fields, layout, finite=False)
    frames = len(values["mano_global_pos"])
    if "mano_joint_pos" in fields:
        flat = (frames, 63) if fields["mano_joint_pos"].ndim == 2 else (frames, 21, 3)
        values |= numbers(path, fields, {"mano_joint_pos": flat}, finite=False)
    valid = recorded(path, *values.values())

    whole = turns(values["mano_global_rot_aa"], valid)
    pose = turns(values["mano_hand_pose"].reshape(frames, -1, 3), valid)
    own = pose[:, 0] if width == 48 else np.broadcast_to(np.eye(3), (frames, 3, 3))
    shape = one_shape(numbers(path, fields, {"shape": ("s",)})["shape"], valid) if "shape" in fields else np.zeros(10)
    if "mano_joint_pos" in values:
        joints = values["mano_joint_pos"].reshape(frames, 21, 3).astype(float)
        subject = subject_with_joints(path, shape, own, pose[:, -15:], joints, valid)
    else:
        subject = subject_of(request, side, shape)
    rate = {"data_fps": plain(path, "data_fps", contents["data_fps"])} if "data_fps" in contents else {}
    return mano_motion(
        path,
        orientation=whole @ own,
        rotations=pose[:, -15:],
        wrist=values["mano_global_pos"] + whole @ subject.wrist,
        valid=valid,
        subject=subject,
        fps=float(numbers(path, rate, {"data_fps": ()})["data_fps"]) if rate else FPS,
        side=side,
        source=f"DexCanvas {path.stem}",
    )


FORMAT = DatasetFormat(
    name=f"DexCanvas (a row's .pkl or a hand's .npz with {', '.join(_NEEDED)})", recognises=_recognises, read=_read
)
