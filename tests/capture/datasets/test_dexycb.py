import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from tests.capture.datasets.subjects import joints_of, licensed_file, licensed_hand, posed_joints, rest_joints, take

TAKE = take(seed=1)
TABLE = np.concatenate([Rotation.from_rotvec([0.4, -1.0, 0.3]).as_matrix(), [[0.2], [-0.1], [0.9]]], axis=1)
META = {
    "num_frames": 6,
    "mano_sides": ["right"],
    "mano_calib": ["20200514_142106_subject-09_right"],
    "extrinsics": "20201014_121801",
    "serials": ["836212060125"],
    "ycb_ids": [2],
}


def write(root, side: str = "right", pose=None, **meta):
    sequence = root / "20201015-subject-09" / "20201015_142601"
    calibration = root / "calibration"
    mano = calibration / f"mano_{META['mano_calib'][0]}"
    extrinsics = calibration / f"extrinsics_{META['extrinsics']}"
    for folder in (sequence, mano, extrinsics):
        folder.mkdir(parents=True, exist_ok=True)
    (sequence / "meta.yml").write_text(yaml.safe_dump(META | {"mano_sides": [side]} | meta))
    (mano / "mano.yml").write_text(yaml.safe_dump({"betas": TAKE.shape.tolist()}))
    tag = {"extrinsics": {"apriltag": TABLE.ravel().tolist()}, "master": "836212060125"}
    (extrinsics / "extrinsics.yml").write_text(yaml.safe_dump(tag))
    if pose is None:
        pose = rows(side)
    np.savez(sequence / "pose.npz", pose_m=pose[:, None].astype(np.float32), pose_y=np.zeros((6, 1, 7), np.float32))
    return sequence


def rows(side: str) -> np.ndarray:
    return np.concatenate([TAKE.pose[:, 0], TAKE.coefficients(side, mean=True), TAKE.translation], axis=1)


@pytest.mark.parametrize("side", ["right", "left"])
def test_joints_are_where_the_datasets_own_formula_puts_them_seen_from_the_table(tmp_path, side):
    motion = load_motion(write(tmp_path, side), mano=licensed_file(tmp_path, side))
    in_camera = posed_joints(rest_joints(licensed_hand(side), TAKE.shape), TAKE.pose) + TAKE.translation[:, None]
    found = joints_of(motion) @ TABLE[:, :3].T + TABLE[:, 3]
    np.testing.assert_allclose(found, in_camera[:, :16], atol=1e-5)
    assert (motion.fps, motion.side) == (30.0, side)
    assert motion.source == f"DexYCB 20201015-subject-09/20201015_142601, {side} hand"


def test_frames_of_zeros_are_gaps(tmp_path):
    pose = rows("right")
    pose[:2] = 0
    motion = load_motion(write(tmp_path, pose=pose), mano=licensed_file(tmp_path))
    assert motion.valid.tolist() == [False, False, True, True, True, True]


def test_pca_poses_need_the_licensed_file(tmp_path):
    with pytest.raises(InputError, match=r"PCA poses need MANO_RIGHT\.pkl: give mano="):
        load_motion(write(tmp_path))


@pytest.mark.parametrize(
    ("meta", "message"),
    [
        ({"num_frames": 7}, r"pose_m has shape \(6, 1, 51\), expected \(7, 1, 51\)"),
        ({"mano_sides": []}, r"mano_sides is \[\], expected a list"),
        ({"mano_sides": ["both"]}, r"names hands \['both'\], expected 'right' and 'left'"),
        ({"mano_calib": ["nobody"]}, r"mano_nobody/mano\.yml: no such file; keep the dataset's folders"),
        ({"extrinsics": "never"}, r"extrinsics_never/extrinsics\.yml: no such file"),
    ],
)
def test_folders_that_do_not_fit_together(tmp_path, meta, message):
    with pytest.raises(InputError, match=message) as refusal:
        load_motion(write(tmp_path, **meta), mano=licensed_file(tmp_path))
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("meta.yml", "serials: [a", "not YAML"),
        ("meta.yml", "serials: []", "has no 'num_frames'; it needs num_frames, mano_sides, mano_calib, extrinsics"),
        ("../../calibration/extrinsics_20201014_121801/extrinsics.yml", "extrinsics: {}", "has no 'apriltag'"),
        (
            "../../calibration/extrinsics_20201014_121801/extrinsics.yml",
            f"extrinsics: {{apriltag: {[1.0] * 12}}}",
            "apriltag is not a rigid transform",
        ),
        ("../../calibration/mano_20200514_142106_subject-09_right/mano.yml", "betas: [big]", "betas holds object"),
        ("pose.npz", "PK", "not a readable .npz"),
    ],
)
def test_damaged_files_are_named(tmp_path, file, text, message):
    folder = write(tmp_path)
    (folder / file).write_text(text)
    with pytest.raises(InputError, match=message) as refusal:
        load_motion(folder, mano=licensed_file(tmp_path))
    assert "\n" not in str(refusal.value)
