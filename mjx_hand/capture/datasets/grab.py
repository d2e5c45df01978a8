"""GRAB (Taheri et al., ECCV 2020, https://grab.is.tue.mpg.de): `grab/SUBJECT/SEQUENCE.npz`.

Layout: https://github.com/otaheri/GRAB (README.md, grab/grab_preprocessing.py). `framerate` (120 frames/s), and
pickled dictionaries `rhand` and `lhand`, each with:

- `params`: `global_orient` (T, 3) and `fullpose` (T, 45), axis-angles (rad) about the flat hand; `hand_pose` (T, n),
  the PCA coefficients of the same pose; `transl` (T, 3), metres.
- `vtemp`: the path, below the dataset's root, of a mesh of the subject's own hand at rest; there are no coefficients.

The tools make the hand with `flat_hand_mean=True`: nothing is to be added. Where `fullpose` is not there, the
coefficients need the licensed file. `transl` is added to a hand that was turned about its wrist joint; the licensed
file finds that joint, and the others, in the subject's mesh, or in the mean hand's where the mesh is not there. Poses
are in the capture system's frame, z up.

`object`: `params` with `global_orient` and `transl` (T, 3), and `object_mesh`, the path of its mesh (m) below the root;
`obj_name`. The tools multiply the mesh's vertices, as rows, by the rotation's matrix (tools/objectmodel.py): the object
is turned by its inverse. Body, table and contacts are not read.
"""

from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import trimesh

from mjx_hand.capture.dataset_files.dataset_root import beside
from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import chosen_side, hands_of, mano_motion, recorded, turns
from mjx_hand.capture.datasets.subject import full_pose, subject_of
from mjx_hand.capture.object_poses.with_mesh import object_with_mesh
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import plain, unwrapped
from mjx_hand.hand.mano_file import MANO_VERTICES
from mjx_hand.motion import Motion, RecordedObject, RecordedScene, make_scene

_KEYS = {"right": "rhand", "left": "lhand"}


def _hands(contents: Contents) -> dict[str, dict[str, Any]]:
    hands = {side: unwrapped(contents.get(key)) for side, key in _KEYS.items()}
    return {
        side: hand for side, hand in hands.items() if isinstance(hand, dict) and isinstance(hand.get("params"), dict)
    }


def _recognises(path: Path, contents: Contents) -> bool:
    return "framerate" in contents and bool(_hands(contents))


def _text(value: Any) -> str:
    """Text, whether Python's or NumPy's; none of anything else."""
    found = value.item() if isinstance(value, np.ndarray) and value.size == 1 else value
    return found if isinstance(found, str) and found.isprintable() else ""


def _template(path: Path, hand: dict[str, Any]) -> np.ndarray | None:
    """The subject's rest vertices (m), if the mesh that the recording names is there."""
    named = PurePosixPath(_text(hand.get("vtemp")))
    if named.is_absolute() or ".." in named.parts or named.suffix.lower() != ".ply":
        return None
    mesh = beside(path, 3, str(named))
    if not mesh.is_file():
        return None
    try:
        vertices = np.asarray(trimesh.load_mesh(mesh, process=False).vertices, float)
    except Exception as error:  # the reader of meshes raises anything at all
        raise InputError(f"{mesh}: not a readable mesh ({type(error).__name__}); get it again") from None
    return numbers(mesh, {"vertices": vertices}, {"vertices": (MANO_VERTICES, 3)})["vertices"]


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    hands = _hands(contents)
    side = chosen_side(path, list(hands), request)
    hand = hands[side]
    found = {name: plain(path, f"{_KEYS[side]} {name}", value) for name, value in hand["params"].items()}
    layout = {"global_orient": ("t", 3), "transl": ("t", 3)}
    layout |= {"fullpose": ("t", 45)} if "fullpose" in found else {"hand_pose": ("t", "n")}
    values = numbers(path, found, layout, finite=False)
    valid = recorded(path, *values.values())
    if "fullpose" in values:
        pose = values["fullpose"].reshape(-1, 15, 3)
    else:
        pose = full_pose(path, request, side, values["hand_pose"], components=True, mean=False)
    template = None if request.mano is None else _template(path, hand)
    subject = subject_of(request, side, np.zeros(10), template=template)
    rate = numbers(path, {"framerate": plain(path, "framerate", contents["framerate"])}, {"framerate": ()})["framerate"]
    return mano_motion(
        path,
        orientation=turns(values["global_orient"], valid),
        rotations=turns(pose, valid),
        wrist=values["transl"] + subject.wrist,
        valid=valid,
        subject=subject,
        fps=float(rate),
        side=side,
        source=f"GRAB {path.absolute().parent.name}/{path.stem}" + (", mean bones" if template is None else ""),
    )


def _object(path: Path, contents: Contents) -> tuple[RecordedObject, ...]:
    told = unwrapped(contents.get("object"))
    if not isinstance(told, dict) or not isinstance(told.get("params"), dict):
        return ()
    found = {name: plain(path, f"object {name}", value) for name, value in told["params"].items()}
    n = numbers(path, found, {"global_orient": ("t", 3), "transl": ("t", 3)}, finite=False)
    seen = recorded(path, *n.values())
    poses = np.tile(np.eye(4), (len(seen), 1, 1))
    poses[:, :3, :3] = np.swapaxes(turns(n["global_orient"], seen), 1, 2)
    poses[:, :3, 3] = np.where(seen[:, None], n["transl"], 0.0)
    named = PurePosixPath(_text(told.get("object_mesh")))
    sound = named.suffix.lower() == ".ply" and not named.is_absolute() and ".." not in named.parts
    name = _text(plain(path, "obj_name", contents["obj_name"])) if "obj_name" in contents else ""
    mesh = beside(path, 3, str(named)) if sound else None
    return (object_with_mesh(name or named.stem or "object", poses, mesh, seen=seen),)


def _read_scene(path: Path, contents: Contents, request: Request) -> RecordedScene:
    hands = hands_of(_read, path, contents, request, list(_hands(contents)))
    source = f"GRAB {path.absolute().parent.name}/{path.stem}"
    return make_scene(hands, _object(path, contents), up="+z", source=source)


FORMAT = DatasetFormat(
    name="GRAB (.npz with framerate and rhand, lhand)", recognises=_recognises, read=_read, read_scene=_read_scene
)
