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

The object (`SEQUENCE.object.npy`) and the body are not read.
"""

from pathlib import Path

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import chosen_side, mano_motion, recorded, turns
from mjx_hand.capture.datasets.subject import full_pose, one_shape, subject_of
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import plain, unwrapped
from mjx_hand.motion import Motion

FPS = 30.0
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
    return path.suffix == ".npy" and any(_hands(one) for one in (contents, *_sequences(contents).values()))


def _chosen(path: Path, contents: Contents, request: Request) -> tuple[str, Contents]:
    """The sequence that the request names, and its name."""
    several = _sequences(contents)
    if not several:
        if request.sequence is not None:
            raise InputError(f"{path}: holds one recording; leave out sequence={request.sequence!r}")
        return f"{path.absolute().parent.name}/{path.name.removesuffix('.npy').removesuffix('.mano')}", contents
    if request.sequence not in several:
        names = ", ".join(sorted(several)[:_SHOWN]) + (", and more" if len(several) > _SHOWN else "")
        asked = "several sequences" if request.sequence is None else f"no sequence {request.sequence!r}"
        raise InputError(f"{path}: holds {asked}; choose one with sequence=: {names}")
    return request.sequence, several[request.sequence]


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    sequence, contents = _chosen(path, contents, request)
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


FORMAT = DatasetFormat(
    name="ARCTIC (.npy with right and left: rot, pose, trans, shape)",
    recognises=_recognises,
    read=_read,
    has_sequences=True,
)
