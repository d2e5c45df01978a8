"""HO-Cap (Wang et al. 2024, https://irvlutd.github.io/HOCap): a sequence's folder, with `meta.yaml` and `poses_m.npy`.

Layout: https://github.com/IRVLUTD/HO-Cap (hocap/loaders/sequence_loader.py, hocap/layers/mano_layer.py).

- `poses_m.npy` (2, T, 51): right hand, then left; axis-angle of the wrist, 45 PCA coefficients, translation (m). Rows
  of -1 stand for a hand that is not there, as users of the dataset found; the toolkit does not say so.
- `meta.yaml` (or `meta.json`): `mano_sides`, `num_frames`, and the subject as `subject_id` (or `calibration.mano`).
- `../../calibration/mano/SUBJECT.yaml` (or `SUBJECT/mano.json`): `betas` (10), for both hands.

The toolkit makes the hand with `flat_hand_mean=True` and 45 components: the licensed file is needed for its components,
and no mean is added. That could not be checked on a recording. It names `center_idx=0`, which its library (manopth)
ignores where there is a translation, so the wrist is at the translation plus its place at rest. Poses are in the
table's frame, that of `tag_1`, z up. 30 frames per second.

`poses_o.npy` (n, T, 7): quaternion xyzw and translation (m) of each of `object_ids` in `meta.yaml`, in the same frame;
rows of -1 or 0 where it is not there. Meshes (m): `../../models/ID/cleaned_mesh_10000.obj` or `textured_mesh.obj`.
"""

from pathlib import Path

import numpy as np

from mjx_hand.capture.dataset_files.calibration import betas, read_settings
from mjx_hand.capture.dataset_files.dataset_root import beside, one_name
from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import chosen_side, hands_of, mano_motion, recorded, some, turns
from mjx_hand.capture.datasets.subject import full_pose, subject_of
from mjx_hand.capture.object_poses.with_mesh import object_with_mesh
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import WHOLE, plain, read_contents
from mjx_hand.motion import Motion, RecordedObject, RecordedScene, make_scene

FPS = 30.0
_MESHES = ("cleaned_mesh_10000.obj", "textured_mesh.obj")
_SIDES = ("right", "left")


def _meta(path: Path) -> Path:
    return next((path / name for name in ("meta.yaml", "meta.json") if (path / name).is_file()), path / "meta.yaml")


def _recognises(path: Path, contents: Contents) -> bool:
    return (path / "poses_m.npy").is_file() and _meta(path).is_file()


def _calibration(path: Path, meta: dict) -> Path:
    """The subject's file of shape coefficients."""
    older = meta.get("calibration")
    subject = meta.get("subject_id") or (older.get("mano") if isinstance(older, dict) else None)
    if subject is None:
        raise InputError(f"{_meta(path)}: names no subject; it needs subject_id")
    name = one_name(_meta(path), "subject_id", subject)
    named = [beside(path, 2, f"calibration/mano/{file}") for file in (f"{name}.yaml", f"{name}/mano.json")]
    return next((file for file in named if file.is_file()), named[0])


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    meta = read_settings(_meta(path), {"mano_sides": list, "num_frames": int})
    side = chosen_side(path, meta["mano_sides"], request)
    whole = {"poses_m": plain(path, "poses_m.npy", read_contents(path / "poses_m.npy").get(WHOLE))}
    poses = numbers(path, whole, {"poses_m": (2, meta["num_frames"], 51)}, finite=False)["poses_m"].astype(float)
    pose = poses[_SIDES.index(side)]
    absent = (pose == -1).all(axis=1) | (pose == 0).all(axis=1)
    valid = some(path, recorded(path, pose) & ~absent)
    subject = subject_of(request, side, betas(_calibration(path, meta)))
    return mano_motion(
        path,
        orientation=turns(pose[:, :3], valid),
        rotations=turns(full_pose(path, request, side, pose[:, 3:48], components=True, mean=False), valid),
        wrist=pose[:, 48:] + subject.wrist,
        valid=valid,
        subject=subject,
        fps=FPS,
        side=side,
        source=f"HO-Cap {path.absolute().parent.name}/{path.absolute().name}",
    )


def _objects(path: Path, frames: int) -> tuple[RecordedObject, ...]:
    file = path / "poses_o.npy"
    if not file.is_file() or "object_ids" not in read_settings(_meta(path), {}):
        return ()
    ids = read_settings(_meta(path), {"object_ids": list})["object_ids"]
    names = [one_name(_meta(path), "object_ids", each) for each in ids]
    whole = {"poses_o": plain(path, "poses_o.npy", read_contents(file).get(WHOLE))}
    rows = numbers(path, whole, {"poses_o": (len(names), frames, 7)}, finite=False)["poses_o"].astype(float)
    found = []
    for name, own in zip(names, rows, strict=True):
        seen = np.isfinite(own).all(axis=1) & (own != -1).any(axis=1) & (own[:, :4] != 0).any(axis=1)
        if seen.any():
            poses = np.where(seen[:, None], own[:, [4, 5, 6, 3, 0, 1, 2]], [0.0, 0, 0, 1, 0, 0, 0])
            meshes = [beside(path, 2, f"models/{name}/{each}") for each in _MESHES]
            mesh = next((each for each in meshes if each.is_file()), None)
            found.append(object_with_mesh(name, poses, mesh, seen=seen))
    return tuple(found)


def _read_scene(path: Path, contents: Contents, request: Request) -> RecordedScene:
    meta = read_settings(_meta(path), {"mano_sides": list, "num_frames": int})
    hands = hands_of(_read, path, contents, request, meta["mano_sides"])
    source = f"HO-Cap {path.absolute().parent.name}/{path.absolute().name}"
    return make_scene(hands, _objects(path, meta["num_frames"]), up="+z", source=source)


FORMAT = DatasetFormat(
    name="HO-Cap (a sequence's folder with meta.yaml and poses_m.npy)",
    recognises=_recognises,
    read=_read,
    read_scene=_read_scene,
)
