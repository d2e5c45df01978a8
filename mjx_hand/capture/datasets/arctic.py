"""ARCTIC (Fan et al., CVPR 2023, https://arctic.is.tue.mpg.de): its `.npy` files with MANO parameters.

Layout: https://github.com/zc-alexfan/arctic/blob/master/docs/data/data_doc.md. Pickled dictionaries:

- `raw_seqs/SUBJECT/SEQUENCE.mano.npy`: `right` and `left`, each with `rot` (T, 3) and `pose` (T, 45), axis-angles
  (rad); `trans` (T, 3), metres; `shape` (10,) or (T, 10); `fitting_err` (T,), not read.
- `processed_seqs/SUBJECT/SEQUENCE.npy`: the same in `params`, named `rot_r`, `pose_r`, `trans_r`, `shape_r`, and `_l`.
- `splits/NAME.npy`: many of these in `data_dict`, by names such as s05/box_use_01: `sequence` chooses one.

Frames are 30/s (the paper), in the world frame of the capture system.

The dataset's tools make the hand with `flat_hand_mean=False` (common/body_models.py): `pose` is relative to MANO's mean
pose, so the licensed file is needed. `trans` is added to a hand that was turned about its wrist joint: the wrist is at
`trans` plus the joint's place at rest.

The object: `SEQUENCE.object.npy` (T, 7) beside the raw hands, angle (rad), axis-angle, translation (mm); in processed
files `obj_arti`, `obj_rot` and `obj_trans`. It is called as its sequence begins (box_grab_01). Its meshes are `top.obj`
and `bottom.obj` (mm) in `meta/object_vtemplates/NAME`, beside `raw_seqs`: the top turns by the angle about the axis
(0, 0, -1) through their common origin, before both are moved (common/object_tensors.py). The body is not read.
"""

from functools import partial
from pathlib import Path

import numpy as np

from mjx_hand.capture.dataset_files.dataset_root import beside
from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import chosen_side, hands_of, mano_motion, recorded, turns
from mjx_hand.capture.datasets.subject import full_pose, one_shape, subject_of
from mjx_hand.capture.object_poses.with_mesh import object_with_mesh
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import WHOLE, plain, read_contents, unwrapped
from mjx_hand.motion import Motion, RecordedObject, RecordedScene, make_scene
from mjx_hand.motion.scene import Hinge
from mjx_hand.pytree import replace

FPS = 30.0
_OBJECT: dict[str, tuple[int | str, ...]] = {"obj_arti": ("t",), "obj_rot": ("t", 3), "obj_trans": ("t", 3)}
_AXIS = np.array([0.0, 0.0, -1.0])
_FIELDS = ("rot", "pose", "trans", "shape")
_SHOWN = 6  # how many names of sequences a message lists


def _hands(contents: Contents) -> dict[str, Contents]:
    hands = {side: unwrapped(contents.get(side)) for side in ("right", "left")}
    params = unwrapped(contents.get("params"))
    if isinstance(params, dict):
        named = {"right": "r", "left": "l"}
        hands = {
            side: {name: params[f"{name}_{letter}"] for name in _FIELDS if f"{name}_{letter}" in params}
            for side, letter in named.items()
        }
    return {side: hand for side, hand in hands.items() if isinstance(hand, dict) and {"rot", "pose"} <= hand.keys()}


def _sequences(contents: Contents) -> dict[str, Contents]:
    """The sequences in a split's file, by name; nothing in the file of one sequence."""
    found = unwrapped(contents.get("data_dict"))
    return {name: one for name, one in found.items() if isinstance(one, dict)} if isinstance(found, dict) else {}


def _recognises(path: Path, contents: Contents) -> bool:
    return path.suffix.lower() == ".npy" and any(_hands(one) for one in (contents, *_sequences(contents).values()))


def _chosen(path: Path, contents: Contents, request: Request) -> tuple[str, Contents]:
    """The sequence that the request names, and its name."""
    several = _sequences(contents)
    if not several:
        if request.sequence is not None:
            raise InputError(f"{path}: holds one recording; leave out sequence={request.sequence!r}")
        return f"{path.absolute().parent.name}/{path.stem.removesuffix('.mano')}", contents
    if request.sequence not in several:
        names = ", ".join(sorted(several)[:_SHOWN]) + (", and more" if len(several) > _SHOWN else "")
        asked = "several sequences" if request.sequence is None else f"no sequence {request.sequence!r}"
        raise InputError(f"{path}: holds {asked}; choose one with sequence=: {names}")
    return request.sequence, several[request.sequence]


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    sequence, contents = _chosen(path, contents, request)
    return _hand(sequence, path, contents, request)


def _hand(sequence: str, path: Path, contents: Contents, request: Request) -> Motion:
    hands = _hands(contents)
    side = chosen_side(path, list(hands), request)
    found = {name: plain(path, f"{side} {name}", hands[side][name]) for name in _FIELDS if name in hands[side]}
    by_frame = "shape" in found and found["shape"].ndim == 2
    layout = {"rot": ("t", 3), "pose": ("t", 45), "trans": ("t", 3), "shape": ("t", 10) if by_frame else (10,)}
    values = numbers(path, found, layout, finite=False)
    valid = recorded(path, values["rot"], values["pose"], values["trans"])
    pose = full_pose(path, request, side, values["pose"], components=False, mean=True)
    subject = subject_of(request, side, one_shape(values["shape"], valid))
    return mano_motion(
        path,
        orientation=turns(values["rot"], valid),
        rotations=turns(pose, valid),
        wrist=values["trans"] + subject.wrist,
        valid=valid,
        subject=subject,
        fps=FPS,
        side=side,
        source=f"ARCTIC {sequence}",
    )


def _object(path: Path, contents: Contents, sequence: str) -> tuple[RecordedObject, ...]:
    """The two parts of the object: the bottom, and the top that turns about it."""
    file = path.with_name(path.name.removesuffix(".mano.npy") + ".object.npy")
    params = unwrapped(contents.get("params"))
    if isinstance(params, dict) and "obj_rot" in params:
        given = {name: plain(path, name, params[name]) for name in _OBJECT if name in params}
        n = numbers(path, given, _OBJECT, finite=False)
        rows = np.column_stack([n[name] for name in _OBJECT]).astype(float)
    elif path.name.endswith(".mano.npy") and file.is_file():
        whole = {"object": plain(file, "object", read_contents(file).get(WHOLE))}
        rows = numbers(file, whole, {"object": ("t", 7)}, finite=False)["object"].astype(float)
    else:
        return ()
    rows[:, 4:] /= 1e3
    seen = recorded(path, rows)
    angle, turn = np.where(seen, rows[:, 0], 0.0), turns(rows[:, 1:4], seen)
    poses = np.tile(np.eye(4), (2, len(rows), 1, 1))
    poses[0, :, :3, :3] = turn
    poses[1, :, :3, :3] = turn @ turns(angle[:, None] * _AXIS, seen)
    poses[:, :, :3, 3] = np.where(seen[:, None], rows[:, 4:], 0.0)
    name = sequence.rpartition("/")[2].partition("_")[0]
    bottom, top = (
        object_with_mesh(f"{name} {part}", own, _mesh(path, name, part), unit="mm", seen=seen)
        for part, own in zip(("bottom", "top"), poses, strict=True)
    )
    return bottom, replace(top, hinge=Hinge(point=np.zeros(3), axis=_AXIS, angle=angle, parent=bottom.name))


def _mesh(path: Path, name: str, part: str) -> Path | None:
    sound = name.isidentifier()  # part of a path
    return beside(path, 3, f"meta/object_vtemplates/{name}/{part}.obj") if sound else None


def _read_scene(path: Path, contents: Contents, request: Request) -> RecordedScene:
    sequence, chosen = _chosen(path, contents, request)
    hands = hands_of(partial(_hand, sequence), path, chosen, request, list(_hands(chosen)))
    return make_scene(hands, _object(path, chosen, sequence), source=f"ARCTIC {sequence}")


FORMAT = DatasetFormat(
    name="ARCTIC (.npy with right and left: rot, pose, trans, shape)",
    recognises=_recognises,
    read=_read,
    has_sequences=True,
    read_scene=_read_scene,
)
