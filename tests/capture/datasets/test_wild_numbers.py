"""Numbers that are no angle and no place, in any field of a recording: one line, and no warning of NumPy's."""

import pickle

import numpy as np
import pytest

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from tests.capture.datasets import test_dexcanvas, test_dexycb, test_grab, test_hamer, test_hocap
from tests.capture.datasets.subjects import licensed_file

WILD = 1e300


def with_wild(values: np.ndarray, frame: int = 2) -> np.ndarray:
    changed = np.array(values, float, order="C")
    changed.reshape(len(changed), -1)[frame, 1] = WILD
    return changed


def refused(path, message: str = "frame 2 holds 1e\\+300", **options) -> None:
    with pytest.raises(InputError, match=message) as caught:
        load_motion(path, **options)
    assert "\n" not in str(caught.value)


def test_in_folders(tmp_path):
    mano = licensed_file(tmp_path)
    poses = test_hocap.rows()
    poses[0] = with_wild(poses[0])
    refused(test_hocap.write(tmp_path / "cap", sides=["right"], poses=poses), mano=mano)
    rows = test_dexycb.rows("right")
    rows[2, 1] = 1e38  # single precision
    refused(test_dexycb.write(tmp_path / "ycb", pose=rows), "frame 2 holds 1e\\+38", mano=mano)


@pytest.mark.parametrize("name", ["transl", "global_orient", "fullpose"])
def test_in_grab(tmp_path, name):
    shape = {"transl": (6, 3), "global_orient": (6, 3), "fullpose": (6, 45)}[name]
    params: dict = {name: with_wild(np.zeros(shape))}
    refused(test_grab.write(tmp_path, **params))


@pytest.mark.parametrize("name", ["mano_global_pos", "mano_global_rot_aa", "mano_hand_pose", "mano_joint_pos"])
def test_in_dexcanvas(tmp_path, name):
    fields = test_dexcanvas.fields()
    refused(test_dexcanvas.write_row(tmp_path, {"right": fields | {name: with_wild(fields[name])}}))


def test_in_estimates(tmp_path):
    for name, message in (("hand_pose", "image 1: frame 0 holds"), ("betas", "shape|frame 1 holds")):
        images = [test_hamer.output(k) for k in range(3)]
        values = images[1]["pred_mano_params"]
        values[name] = np.array(values[name])
        values[name].flat[1] = WILD
        (tmp_path / "video.pkl").write_bytes(pickle.dumps(images))
        refused(tmp_path / "video.pkl", message, fps=30)
    images = [[test_hamer.mini(k, "right")] for k in range(3)]
    images[1][0]["wilor_preds"]["hand_pose"] = images[1][0]["wilor_preds"]["hand_pose"] * WILD
    (tmp_path / "video.pkl").write_bytes(pickle.dumps(images))
    refused(tmp_path / "video.pkl", "image 1: frame 0 holds", fps=30)
