"""DexYCB (Chao et al., CVPR 2021, https://dex-ycb.github.io): the folder of a sequence, with `meta.yml` and `pose.npz`.

Layout: https://github.com/NVlabs/dex-ycb-toolkit (README.md, sequence_loader.py, layers/mano_layer.py).

- `pose.npz`: `pose_m` (T, 1, 51): axis-angle of the wrist, 45 PCA coefficients, translation (m); all zero where the
  hand is not there. `pose_y`, the objects' poses, is not read.
- `meta.yml`: `num_frames`, `mano_sides`, `mano_calib`, `extrinsics`.
- `../../calibration/mano_CALIB/mano.yml`: `betas` (10). `../../calibration/extrinsics_NAME/extrinsics.yml`:
  `extrinsics`, of which `apriltag` is a (3, 4) transform.

The hand is made with `flat_hand_mean=False` and 45 components, so the licensed file is needed; the translation is added
to a hand that was turned about its wrist joint. Poses are in the master camera's frame; here they are brought to the
table's, that of the AprilTag on it (z up), as the dataset's own viewer does to find the table. 30 frames per second.
"""

from pathlib import Path

from mjx_hand.capture.datasets.calibration import betas, read_settings, transform
from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import chosen_side, mano_motion, recorded, some, turns
from mjx_hand.capture.datasets.subject import full_pose, subject_of
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import read_contents
from mjx_hand.motion import Motion

FPS = 30.0


def _recognises(path: Path, contents: Contents) -> bool:
    return (path / "meta.yml").is_file() and (path / "pose.npz").is_file()


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    needed = {"num_frames": int, "mano_sides": list, "mano_calib": list, "extrinsics": str}
    meta = read_settings(path / "meta.yml", needed)
    side = chosen_side(path, meta["mano_sides"], request)
    calibration = path.absolute().parent.parent / "calibration"
    shape = betas(calibration / f"mano_{meta['mano_calib'][0]}" / "mano.yml")
    table = transform(calibration / f"extrinsics_{meta['extrinsics']}" / "extrinsics.yml", "apriltag")

    poses = numbers(path, read_contents(path / "pose.npz"), {"pose_m": (meta["num_frames"], 1, 51)}, finite=False)
    pose = poses["pose_m"][:, 0].astype(float)
    valid = some(path, recorded(path, pose) & (pose != 0).any(axis=1))
    subject = subject_of(request, side, shape)
    wrist = pose[:, 48:] + subject.wrist
    return mano_motion(
        path,
        orientation=table[:, :3].T @ turns(pose[:, :3], valid),
        rotations=turns(full_pose(path, request, side, pose[:, 3:48], components=True, mean=True), valid),
        wrist=(wrist - table[:, 3]) @ table[:, :3],
        valid=valid,
        subject=subject,
        fps=FPS,
        side=side,
        source=f"DexYCB {path.absolute().parent.name}/{path.absolute().name}",
    )


FORMAT = DatasetFormat(
    name="DexYCB (a sequence's folder with meta.yml and pose.npz)", recognises=_recognises, read=_read
)
