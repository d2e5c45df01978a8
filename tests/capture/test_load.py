"""`load_motion`: what it recognises, and what it says to everything else."""

import sys

import numpy as np
import pytest

from mjx_hand.capture import datasets
from mjx_hand.capture.datasets.dataset_format import dataset_formats
from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.motion import JointMotion, Motion, save_joint_motion, save_motion


def flat_motion(frames: int = 4) -> Motion:
    return Motion(
        fps=50.0,
        rotations=np.tile(np.eye(3), (frames, 15, 1, 1)),
        wrist_position=np.zeros((frames, 3)),
        wrist_quaternion=np.tile([1.0, 0, 0, 0], (frames, 1)),
        shape=np.zeros(10),
        valid=np.ones(frames, bool),
    )


def test_own_motion_file_is_recognised(tmp_path):
    save_motion(flat_motion(), tmp_path / "motion.npz")
    assert load_motion(tmp_path / "motion.npz").fps == 50.0


def test_every_module_of_the_package_is_found():
    names = {f.name.split()[0] for f in dataset_formats()}
    assert names >= {"ARCTIC", "DexCanvas", "DexMV", "DexYCB", "GRAB", "HO-Cap", "HaMeR", "OakInk2", "mjx-hand"}


def test_a_format_is_added_by_one_file(tmp_path, monkeypatch):
    (tmp_path / "still.py").write_text(
        "import numpy as np\n"
        "from mjx_hand.capture.datasets.dataset_format import DatasetFormat\n"
        "from tests.capture.test_load import flat_motion\n"
        "FORMAT = DatasetFormat('Still', lambda path, _: path.suffix == '.still', lambda *_: flat_motion(7))\n"
    )
    monkeypatch.setattr(datasets, "__path__", [*datasets.__path__, str(tmp_path)])
    (tmp_path / "hand.still").write_text("still")
    assert load_motion(tmp_path / "hand.still").num_frames == 7
    monkeypatch.delitem(sys.modules, "mjx_hand.capture.datasets.still")


def test_joint_motion_is_named_as_what_it_is(tmp_path):
    four = np.zeros((4, 20)), np.zeros((4, 3)), np.tile([1.0, 0, 0, 0], (4, 1)), np.ones(4, bool)
    motion = JointMotion(fps=50.0, angles=four[0], wrist_position=four[1], wrist_quaternion=four[2], valid=four[3])
    save_joint_motion(motion, tmp_path / "angles.npz")
    with pytest.raises(InputError, match="of schema mjx-hand/joint-motion/1, not a motion"):
        load_motion(tmp_path / "angles.npz")


def test_refusals_name_what_was_found_and_what_is_read(tmp_path):
    (tmp_path / "empty.npz").touch()
    (tmp_path / "text.npz").write_text("not an archive")
    (tmp_path / "marks.c3d").write_bytes(b"\x02P")
    (tmp_path / "pose.pkl").write_bytes(b"\x80\x04N.")
    np.savez(tmp_path / "other.npz", allow_pickle=False, **{f"a{k}": np.zeros(2) for k in range(8)})
    np.savez(tmp_path / "pickled.npz", a=np.array([{}], dtype=object))
    expected = {
        "gone.npz": "no such file",
        "": "a folder of no layout that is known here",
        "empty.npz": "the file is empty",
        "text.npz": "not a readable .npz file",
        "marks.c3d": "a marker recording: name its marker set, markers='hand22' or a YAML file, or run mjx-hand fit",
        "pose.pkl": "a lone NoneType without names",
        "other.npz": "an .npz of a0 (2,), a1 (2,), a2 (2,), a3 (2,), a4 (2,), a5 (2,) and more; keypoints are",
        "pickled.npz": "an .npz of a (1,); keypoints are",
    }
    for name, message in expected.items():
        with pytest.raises(InputError) as refusal:
            load_motion(tmp_path / name)
        assert message in str(refusal.value)
        assert "\n" not in str(refusal.value)
