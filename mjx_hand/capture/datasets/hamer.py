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
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.estimated_hands import EstimatedHand, hands_in, is_entry, is_list_of_hands
from mjx_hand.capture.datasets.joint_places import subject_with_joints
from mjx_hand.capture.datasets.mano_motion import LONGEST, chosen_side, frame_rate, mano_motion, recorded, some
from mjx_hand.capture.datasets.subject import one_shape, subject_of
from mjx_hand.errors import InputError
from mjx_hand.files.contents import PICKLES, WHOLE, read_contents, unwrapped
from mjx_hand.motion import Motion


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
        entries = (unwrapped(_entry(read_contents(file))) for _, file in files)
        with_hands = (entry for entry in entries if not (entry is None or (isinstance(entry, list) and not entry)))
        return named and is_entry(next(with_hands, None))
    entry = unwrapped(_entry(contents))
    if isinstance(entry, list) and not is_list_of_hands(entry):
        return any(is_entry(one) for one in entry)
    return is_entry(entry)


def _images(path: Path, contents: Contents) -> dict[int, list[EstimatedHand]]:
    """The hands in each image, by its number."""
    if not path.is_dir():
        entry = unwrapped(_entry(contents))
        listed = entry if isinstance(entry, list) and not is_list_of_hands(entry) else [entry]
        return {k: hands_in(f"{path}: image {k}", one) for k, one in enumerate(listed)}
    files = {number: file for number, file in _files(path) if number is not None}
    if len(files) < len(_files(path)) or max(files) - min(files) > LONGEST:
        raise InputError(f"{path}: two files have one number, or numbers are wild; name them by image, as 000001.npz")
    return {number: hands_in(str(file), _entry(read_contents(file))) for number, file in files.items()}


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
