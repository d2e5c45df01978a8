"""DexCanvas (Xu et al. 2025, arXiv 2510.15786): one trajectory of a table, in Parquet or taken out of it.

The lab's tables (https://huggingface.co/datasets/Dex-GEM/DexCanvas in Parquet, DEXROBOT/DexCanvas in Lance's form) have
a trajectory a row. Read are a `.parquet` file (extra `parquet`; `sequence` is the row's number from 0, or its uuid), a
row as a pickle of its dictionary, or one hand's fields as an `.npz` (with `hand_name` and `shape`, if known). Columns,
as the lab's own writer declares them (https://github.com/DexGEM-Lab/mujoco-warp-contactbench, sim/manorl/lance_v2.py):

- `hands`: a record a hand, or empty lists where the slot is empty. `mano_global_pos` (T, 3), metres, and
  `mano_global_rot_aa` (T, 3), axis-angle (rad): of the whole hand in the world. `mano_hand_pose` (T, 48): axis-angles
  about the flat hand, first the wrist's own (zero in what was seen), then MANO's 15 joints; or (T, 45) without the
  wrist's. `mano_joint_pos` (T, 21, 3) or (T, 63), metres. `urdf_dof`, the angles of the lab's model hand, is not read.
- `objects`: `pos` (T, 3), metres, and `rot_aa` (T, 3), axis-angle (rad): world from object. NaN where it was lost.
- `trajectory_metadata`: `hand_names`, `hand_slots`, `mano_hand_shapes`, `object_names`, and `data_fps` (about 100).
- `contact`: of each frame the links that touch, with forces (N) and places (m). Not read: a scene has no place for it.

World: z up. Meshes, in millimetres: `assets/objects/NAME/NAME_aligned.stl` beside the table or up to two folders above,
as a viewer of these tables has them (https://github.com/conley2bin/lance_visualization, LANCE_GUIDE.md, core/mano.py).
Its formula for the hand: made with `flat_hand_mean=True` from all 48 values, then turned *about the hand model's
origin*, so the wrist is at `mano_global_pos` plus the turned place of the resting wrist. What was captured has the
joints before that turn, wrist first, then thumb to little finger: the first is that place; without joints, it is the
licensed file's or the open hand's. What was replayed in simulation has them in the world: palm, index, middle, ring,
little finger, thumb, three each, then the tips from the thumb on. Bones that keep their length tell which it is, and a
wrist within 20 cm of the origin in what was captured.

None of this could be checked on a recording. Of the released Parquet's card only the introduction could be read, not
its list of columns: a table without `hands` is refused with the names of those it has. So are the first previews'
(`sequence_info`), whose rotations are explained nowhere. Video is not read.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.capture.dataset_files.dataset_root import beside, one_name
from mjx_hand.capture.dataset_files.table_rows import chosen_row
from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.joint_places import subject_with_joints
from mjx_hand.capture.datasets.mano_motion import chosen_side, hands_of, mano_motion, recorded, refuse_wild, turns
from mjx_hand.capture.datasets.subject import Subject, one_shape, subject_of
from mjx_hand.capture.object_poses.with_mesh import object_with_mesh
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import plain, unwrapped
from mjx_hand.files.parquet_table import columns, has_pyarrow, is_parquet
from mjx_hand.motion import Motion, RecordedObject, RecordedScene, make_scene

Array = np.ndarray
FPS = 100.0
UP = "+z"
_COLUMNS = ("index", "trajectory_metadata", "hands", "objects", "data_fps")
_NEEDED = ("mano_global_pos", "mano_global_rot_aa", "mano_hand_pose")
_OTHERS = ("mano_joint_pos", "shape")
# The simulation's joints in the captures' order.
_REPLAYED = (0, 13, 14, 15, 16, 1, 2, 3, 17, 4, 5, 6, 18, 7, 8, 9, 19, 10, 11, 12, 20)
_RESTING_WRIST = 0.2  # m at most of the resting wrist from the hand model's origin: of MANO's 0.1
_MESHES = ("{0}/{0}_aligned.stl", "{0}_aligned.stl", "{0}/{0}.stl", "{0}.stl")


def _is_hand(fields: Any) -> bool:
    return isinstance(fields, dict) and all(name in fields for name in _NEEDED)


def _rows(contents: Contents) -> list[Any]:
    """The hands' fields: those of a row, or the contents themselves."""
    hands = unwrapped(contents.get("hands"))
    return hands if isinstance(hands, list) else [dict(contents)]


def _meta(contents: Contents) -> dict[str, Any]:
    meta = unwrapped(contents.get("trajectory_metadata"))
    return meta if isinstance(meta, dict) else {}


def _listed(path: Path, meta: dict[str, Any], name: str) -> list[Any]:
    """What the row says of each hand or object under that name; nothing where it does not."""
    value = unwrapped(meta.get(name))
    if value is None or isinstance(value, list | tuple):
        return list(value or ())
    return list(np.atleast_1d(plain(path, name, value)))


def _recognises(path: Path, contents: Contents) -> bool:
    if is_parquet(path):
        return not has_pyarrow() or "hands" in columns(path)  # nothing else here is Parquet
    return any(_is_hand(fields) for fields in _rows(contents))


def _trajectory(path: Path, contents: Contents, request: Request) -> tuple[str, Contents]:
    """The trajectory that the request names, and what it is called."""
    if is_parquet(path):
        return chosen_row(path, request.sequence, _COLUMNS)
    if request.sequence is not None:
        raise InputError(f"{path}: holds one recording; leave out sequence={request.sequence!r}")
    return path.stem, contents


def _is_empty(value: Any) -> bool:
    return value is None or (isinstance(value, list | tuple) and not value)


def _hands(path: Path, contents: Contents, request: Request) -> dict[str, dict[str, Any]]:
    """The hands by side, each with its shape."""
    meta = _meta(contents)
    names, slots, shapes = (_listed(path, meta, name) for name in ("hand_names", "hand_slots", "mano_hand_shapes"))
    hands, rows = {}, _rows(contents)
    for k, fields in enumerate(rows):
        if not _is_hand(fields) or _is_empty(fields["mano_global_pos"]):
            continue  # an empty slot
        called = (fields.get("hand_name"), *slots[k : k + 1], *names[k : k + 1], request.side)
        side = next((side for each in called for side in ("right", "left") if side in str(each).lower()), None)
        if side is None:
            raise InputError(f"{path}: does not say which hand it is; give side='right' or side='left'")
        own = next((i for i, each in enumerate(names) if side in str(each).lower()), k)
        told = fields | ({"shape": shapes[own]} if own < len(shapes) else {})
        hands[side] = {name: value for name, value in told.items() if value is not None}
    other = next((fields for fields in rows if isinstance(fields, dict) and not _is_hand(fields)), None)
    if not hands and other is not None:
        raise InputError(f"{path}: a hand needs {', '.join(_NEEDED)}; there are {', '.join(map(str, other))}")
    return hands


def _array(path: Path, name: str, value: Any) -> Array:
    """A field as an array: lists of a table at once, all else as `plain` reads it."""
    try:
        return np.asarray(value, float) if isinstance(value, list) else plain(path, name, value)
    except (TypeError, ValueError, OverflowError):
        return plain(path, name, value)


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    name, row = _trajectory(path, contents, request)
    return _hand(name, path, row, request)


def _hand(name: str, path: Path, row: Contents, request: Request) -> Motion:
    hands = _hands(path, row, request)
    side = chosen_side(path, list(hands), request)
    fields = {name: _array(path, name, hands[side][name]) for name in (*_NEEDED, *_OTHERS) if name in hands[side]}
    width = 45 if np.shape(fields.get("mano_hand_pose", ()))[-1:] == (45,) else 48
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
    place = values["mano_global_pos"]
    if "mano_joint_pos" in values:
        joints = np.where(valid[:, None, None], values["mano_joint_pos"].reshape(frames, 21, 3), 0.0)
        subject, wrist = _with_joints(path, shape, whole, own, pose[:, -15:], joints, place, valid)
    else:
        subject = subject_of(request, side, shape)
        wrist = place + whole @ subject.wrist
    return mano_motion(
        path,
        orientation=whole @ own,
        rotations=pose[:, -15:],
        wrist=wrist,
        valid=valid,
        subject=subject,
        fps=_rate(path, row),
        side=side,
        source=f"DexCanvas {name}",
    )


def _with_joints(
    path: Path,
    shape: Float[Array, "s"],
    whole: Float[Array, "t 3 3"],
    own: Float[Array, "t 3 3"],
    fingers: Float[Array, "t 15 3 3"],
    joints: Float[Array, "t 21 3"],
    place: Float[Array, "t 3"],
    valid: Bool[Array, "t"],
) -> tuple[Subject, Float[Array, "t 3"]]:
    """The subject whose joints these are, and where the wrist is, by the captures' account or the simulation's."""
    refusal = None
    # In a clip in which hardly anything moves all bones keep their lengths by either account.
    if (np.linalg.norm(joints[valid, 0], axis=1) < _RESTING_WRIST).all():
        try:
            subject = subject_with_joints(path, shape, own, fingers, joints, valid)
            return subject, place + whole @ subject.wrist
        except InputError as error:
            refusal = error
    moved = joints[:, _REPLAYED]
    try:
        subject = subject_with_joints(path, shape, whole @ own, fingers, moved - moved[:, :1], valid)
    except InputError as error:
        raise refusal or error from None
    return subject, moved[:, 0]


def _rate(path: Path, row: Contents) -> float:
    told = row if row.get("data_fps") is not None else _meta(row)
    if told.get("data_fps") is None:
        return FPS
    rate = numbers(path, {"data_fps": plain(path, "data_fps", told["data_fps"])}, {"data_fps": ()})
    return float(rate["data_fps"])


def _objects(path: Path, row: Contents) -> tuple[RecordedObject, ...]:
    told = unwrapped(row.get("objects"))
    if told is None:
        return ()
    if not isinstance(told, list | tuple) or not all(isinstance(each, dict) for each in told):
        raise InputError(f"{path}: objects is not a list of records with pos and rot_aa; get the table again")
    listed = [one_name(path, "object_names", str(each)) for each in _listed(path, _meta(row), "object_names")]
    names = [listed[k] if k < len(listed) else f"object_{k}" for k in range(len(told))]
    found = []
    for k, (name, own) in enumerate(zip(names, told, strict=True)):
        fields = {each: own[each] for each in ("pos", "rot_aa") if own.get(each) is not None}
        fields = {each: _array(path, f"{name} {each}", value) for each, value in fields.items()}
        values = numbers(f"{path}: object {name}", fields, {"pos": ("t", 3), "rot_aa": ("t", 3)}, finite=False)
        refuse_wild(f"{path}: object {name}", *values.values())
        seen = np.logical_and.reduce([np.isfinite(value).all(axis=1) for value in values.values()])
        if seen.any():
            poses = np.tile(np.eye(4), (len(seen), 1, 1))
            poses[:, :3, :3] = turns(values["rot_aa"], seen)
            poses[:, :3, 3] = np.where(seen[:, None], values["pos"], 0.0)
            called = name if names.count(name) == 1 else f"{name} {k}"
            found.append(object_with_mesh(called, poses, _mesh(path, name), unit="mm", seen=seen))
    return tuple(found)


def _mesh(path: Path, name: str) -> Path | None:
    places = [beside(path, up, f"assets/objects/{each.format(name)}") for up in (1, 2, 3) for each in _MESHES]
    return next((place for place in places if place.is_file()), None)


def _read_scene(path: Path, contents: Contents, request: Request) -> RecordedScene:
    name, row = _trajectory(path, contents, request)
    hands = hands_of(partial(_hand, name), path, row, request, list(_hands(path, row, request)))
    return make_scene(hands, _objects(path, row), up=UP, source=f"DexCanvas {name}")


FORMAT = DatasetFormat(
    name=f"DexCanvas (a table's .parquet, a row's .pkl or a hand's .npz, with {', '.join(_NEEDED)})",
    recognises=_recognises,
    read=_read,
    has_sequences=True,
    read_scene=_read_scene,
)
