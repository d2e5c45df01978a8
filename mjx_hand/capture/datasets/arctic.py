"""ARCTIC (Fan et al., CVPR 2023, https://arctic.is.tue.mpg.de): `SUBJECT/SEQUENCE.mano.npy` of `raw_seqs`.

Layout: https://github.com/zc-alexfan/arctic/blob/master/docs/data/data_doc.md. A pickled dictionary of `right` and
`left`, each with `rot` (T, 3) and `pose` (T, 45), axis-angles (rad); `trans` (T, 3), metres; `shape` (10,) or (T, 10);
`fitting_err` (T,), not read. Frames are 30/s (the paper), in the world frame of the capture system.

The dataset's tools make the hand with `flat_hand_mean=False` (common/body_models.py): `pose` is relative to MANO's mean
pose, so the licensed file is needed. `trans` is added to a hand that was turned about its wrist joint: the wrist is at
`trans` plus the joint's place at rest.

The object (`SEQUENCE.object.npy`) and the body are not read.
"""

from pathlib import Path

from mjx_hand.capture.datasets.contents import plain, unwrapped
from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import chosen_side, mano_motion, recorded, turns
from mjx_hand.capture.datasets.subject import full_pose, one_shape, subject_of
from mjx_hand.motion import Motion
from mjx_hand.motion.layout import numbers

FPS = 30.0
_FIELDS = ("rot", "pose", "trans", "shape")


def _hands(contents: Contents) -> dict[str, Contents]:
    hands = {side: unwrapped(contents.get(side)) for side in ("right", "left")}
    return {side: hand for side, hand in hands.items() if isinstance(hand, dict) and {"rot", "pose"} <= hand.keys()}


def _recognises(path: Path, contents: Contents) -> bool:
    return path.suffix == ".npy" and bool(_hands(contents))


def _read(path: Path, contents: Contents, request: Request) -> Motion:
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
        source=f"ARCTIC {path.parent.name}/{path.name.removesuffix('.mano.npy')}",
    )


FORMAT = DatasetFormat(
    name="ARCTIC (.mano.npy with right and left: rot, pose, trans, shape)", recognises=_recognises, read=_read
)
