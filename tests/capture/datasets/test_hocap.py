import json

import numpy as np
import pytest
import yaml

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from tests.capture.datasets.subjects import joints_of, licensed_file, licensed_hand, posed_joints, rest_joints, take

TAKE = take(seed=2)


def write(root, released: bool = True, sides=("right", "left"), poses=None, **meta):
    """A sequence in the released dataset's layout, or in the one that the published toolkit reads."""
    folder, mano = root / "subject_1" / "20231025_165502", root / "calibration" / "mano"
    folder.mkdir(parents=True)
    (mano / "subject_1").mkdir(parents=True)
    meta = {"mano_sides": list(sides), "num_frames": 6} | meta
    if released:
        (folder / "meta.yaml").write_text(yaml.safe_dump({"subject_id": "subject_1"} | meta))
        (mano / "subject_1.yaml").write_text(yaml.safe_dump({"betas": TAKE.shape.tolist()}))
    else:
        (folder / "meta.json").write_text(json.dumps({"calibration": {"mano": "subject_1"}} | meta))
        (mano / "subject_1" / "mano.json").write_text(json.dumps({"betas": TAKE.shape.tolist()}))
    np.save(folder / "poses_m.npy", rows() if poses is None else poses)
    np.save(folder / "poses_o.npy", np.zeros((1, 6, 7)))
    return folder


def rows() -> np.ndarray:
    return np.stack(
        [
            np.concatenate([TAKE.pose[:, 0], TAKE.coefficients(side, mean=False), TAKE.translation], axis=1)
            for side in ("right", "left")
        ]
    )


@pytest.mark.parametrize("released", [True, False])
@pytest.mark.parametrize("side", ["right", "left"])
def test_joints_are_where_the_toolkits_formula_puts_them(tmp_path, side, released):
    motion = load_motion(write(tmp_path, released), side=side, mano=licensed_file(tmp_path, side))
    expected = posed_joints(rest_joints(licensed_hand(side), TAKE.shape), TAKE.pose) + TAKE.translation[:, None]
    np.testing.assert_allclose(joints_of(motion), expected[:, :16], atol=1e-5)
    assert (motion.fps, motion.side) == (30.0, side)


def test_rows_of_minus_one_are_gaps(tmp_path):
    poses = rows()
    poses[0, 4:] = -1
    motion = load_motion(write(tmp_path, poses=poses), side="right", mano=licensed_file(tmp_path))
    assert motion.valid.tolist() == [True, True, True, True, False, False]


@pytest.mark.parametrize(
    ("changes", "choice", "message"),
    [
        ({}, {}, "holds both hands; choose one"),
        ({"sides": ["right"]}, {"side": "left"}, "holds no left hand; give side='right'"),
        ({"sides": ["right"]}, {}, "PCA poses need"),
        ({"sides": ["right"], "poses": np.zeros((6, 51))}, {}, r"poses_m has shape \(6, 51\), expected \(2, 6, 51\)"),
        ({"sides": ["right"], "poses": np.full((2, 6, 51), -1.0)}, {}, "in none of its 6 frames"),
        ({"sides": ["right"], "subject_id": None}, {}, "names no subject; it needs subject_id"),
        ({"sides": ["right"], "subject_id": "subject_2"}, {}, r"mano/subject_2\.yaml: no such file"),
    ],
)
def test_refusals(tmp_path, changes, choice, message):
    with pytest.raises(InputError, match=message) as refusal:
        load_motion(write(tmp_path, **changes), **choice)
    assert "\n" not in str(refusal.value)
