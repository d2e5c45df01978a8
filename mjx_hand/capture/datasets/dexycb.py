"""DexYCB (Chao et al., CVPR 2021, https://dex-ycb.github.io): the folder of a sequence, with `meta.yml` and `pose.npz`.

Layout: https://github.com/NVlabs/dex-ycb-toolkit (README.md, sequence_loader.py, layers/mano_layer.py).

- `pose.npz`: `pose_m` (T, 1, 51): axis-angle of the wrist, 45 PCA coefficients, translation (m); all zero where the
  hand is not there. `pose_y` (T, n, 7): each object's quaternion xyzw and translation (m); 0, 0, 0, 1, 0, 0, 0 where it
  is not there.
- `meta.yml`: `num_frames`, `mano_sides`, `mano_calib`, `extrinsics`, and `ycb_ids`, the objects by their numbers among
  the 21 of YCB-Video. `../../models/NAME/textured_simple.obj`: their meshes (m).
- `../../calibration/mano_CALIB/mano.yml`: `betas` (10). `../../calibration/extrinsics_NAME/extrinsics.yml`:
  `extrinsics`, of which `apriltag` is a (3, 4) transform.

The hand is made with `flat_hand_mean=False` and 45 components, so the licensed file is needed; the translation is added
to a hand that was turned about its wrist joint. Poses are in the master camera's frame; here they are brought to the
table's, that of the AprilTag on it (z up), as the dataset's own viewer does to find the table. 30 frames per second.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.capture.dataset_files.calibration import betas, read_settings, transform
from mjx_hand.capture.dataset_files.dataset_root import beside, one_name
from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import chosen_side, hands_of, mano_motion, recorded, some, turns
from mjx_hand.capture.datasets.subject import full_pose, subject_of
from mjx_hand.capture.object_poses.with_mesh import object_with_mesh
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import read_contents
from mjx_hand.motion import Motion, RecordedObject, RecordedScene, make_scene

FPS = 30.0
# The objects of YCB-Video (Xiang et al., RSS 2018), in its order, which the dataset's numbers count from 1.
YCB = (
    *("002_master_chef_can", "003_cracker_box", "004_sugar_box", "005_tomato_soup_can", "006_mustard_bottle"),
    *("007_tuna_fish_can", "008_pudding_box", "009_gelatin_box", "010_potted_meat_can", "011_banana"),
    *("019_pitcher_base", "021_bleach_cleanser", "024_bowl", "025_mug", "035_power_drill", "036_wood_block"),
    *("037_scissors", "040_large_marker", "051_large_clamp", "052_extra_large_clamp", "061_foam_brick"),
)
_ABSENT = np.array([0.0, 0, 0, 1, 0, 0, 0])


def _recognises(path: Path, contents: Contents) -> bool:
    return (path / "meta.yml").is_file() and (path / "pose.npz").is_file()


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    needed = {"num_frames": int, "mano_sides": list, "mano_calib": list, "extrinsics": str}
    meta = read_settings(path / "meta.yml", needed)
    side = chosen_side(path, meta["mano_sides"], request)
    subject = one_name(path / "meta.yml", "mano_calib", meta["mano_calib"][0])
    cameras = one_name(path / "meta.yml", "extrinsics", meta["extrinsics"])
    shape = betas(beside(path, 2, f"calibration/mano_{subject}/mano.yml"))
    table = transform(beside(path, 2, f"calibration/extrinsics_{cameras}/extrinsics.yml"), "apriltag")

    poses = numbers(path, read_contents(path / "pose.npz"), {"pose_m": (meta["num_frames"], 1, 51)}, finite=False)
    pose = poses["pose_m"][:, 0].astype(float)
    valid = some(path, recorded(path, pose) & (pose != 0).any(axis=1))
    hand = subject_of(request, side, shape)
    wrist = pose[:, 48:] + hand.wrist
    return mano_motion(
        path,
        orientation=table[:, :3].T @ turns(pose[:, :3], valid),
        rotations=turns(full_pose(path, request, side, pose[:, 3:48], components=True, mean=True), valid),
        wrist=(wrist - table[:, 3]) @ table[:, :3],
        valid=valid,
        subject=hand,
        fps=FPS,
        side=side,
        source=f"DexYCB {path.absolute().parent.name}/{path.absolute().name}",
    )


def _objects(path: Path, frames: int) -> tuple[RecordedObject, ...]:
    contents, settings = read_contents(path / "pose.npz"), path / "meta.yml"
    if "pose_y" not in contents:
        return ()
    meta = read_settings(settings, {"ycb_ids": list, "extrinsics": str})
    ids = meta["ycb_ids"]
    if not all(type(each) is int and 1 <= each <= len(YCB) for each in ids) or len(set(ids)) < len(ids):
        raise InputError(f"{settings}: ycb_ids is {ids!r}, expected different numbers from 1 to {len(YCB)}"[:300])
    rows = numbers(path, contents, {"pose_y": (frames, len(ids), 7)}, finite=False)["pose_y"].astype(float)
    cameras = one_name(settings, "extrinsics", meta["extrinsics"])
    table = transform(beside(path, 2, f"calibration/extrinsics_{cameras}/extrinsics.yml"), "apriltag")
    found = []
    for each, own in zip(ids, np.swapaxes(rows, 0, 1), strict=True):
        seen = np.isfinite(own).all(axis=1) & (own != _ABSENT).any(axis=1) & (own[:, :4] != 0).any(axis=1)
        if not seen.any():
            continue
        turn = Rotation.from_quat(np.where(seen[:, None], own[:, :4], _ABSENT[:4])).as_matrix()
        poses = np.tile(np.eye(4), (frames, 1, 1))
        poses[:, :3, :3] = table[:, :3].T @ turn
        poses[:, :3, 3] = np.where(seen[:, None], (own[:, 4:] - table[:, 3]) @ table[:, :3], 0.0)
        name = YCB[each - 1]
        found.append(object_with_mesh(name, poses, beside(path, 2, f"models/{name}/textured_simple.obj"), seen=seen))
    return tuple(found)


def _read_scene(path: Path, contents: Contents, request: Request) -> RecordedScene:
    meta = read_settings(path / "meta.yml", {"mano_sides": list})
    hands = hands_of(_read, path, contents, request, meta["mano_sides"])
    source = f"DexYCB {path.absolute().parent.name}/{path.absolute().name}"
    return make_scene(hands, _objects(path, hands[0].num_frames), up="+z", source=source)


FORMAT = DatasetFormat(
    name="DexYCB (a sequence's folder with meta.yml and pose.npz)",
    recognises=_recognises,
    read=_read,
    read_scene=_read_scene,
)
