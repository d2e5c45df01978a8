"""`mjx-hand info` on everything that the project reads and writes, and on what it does not."""

from pathlib import Path

import numpy as np
import pytest

from mjx_hand.capture.keypoints.recording import KeypointRecording, save_keypoints
from mjx_hand.capture.markers.marker_set import included_marker_set
from mjx_hand.cli.main import main
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import (
    Demonstration,
    JointMotion,
    ObjectDescription,
    save_demonstration,
    save_joint_motion,
    save_motion,
)
from mjx_hand.pytree import replace
from tests.capture.keypoints.grips import FPS, FRAMES, grip, keypoints_of
from tests.hand.mano_layout import official, write_npz


def info(capsys, *arguments: object) -> str:
    assert main(["info", *map(str, arguments)]) == 0
    return capsys.readouterr().out


def refused(capsys, path: Path) -> str:
    assert main(["info", str(path)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    return said.err


def joint_motion() -> JointMotion:
    valid = np.ones(FRAMES, bool)
    valid[:6] = False
    return JointMotion(
        fps=FPS,
        angles=np.zeros((FRAMES, NUM_HINGES)),
        wrist_position=np.linspace([0, 0, 0], [0.1, 0, 0], FRAMES),
        wrist_quaternion=np.tile([1.0, 0, 0, 0], (FRAMES, 1)),
        valid=valid,
        source="made",
    )


def test_motion(tmp_path, capsys):
    path = tmp_path / "grip.npz"
    save_motion(replace(grip("left"), source="a grip"), path)
    text = info(capsys, path)
    assert "mjx-hand/motion/1" in text
    assert "left, 10 shape coefficients" in text
    assert "60 at 50/s (1.2 s)" in text
    assert "a grip" in text
    assert f"next: mjx-hand retarget {path} --out angles.npz" in text


def test_joint_motion_and_demonstration(tmp_path, capsys):
    save_joint_motion(joint_motion(), tmp_path / "angles.npz")
    text = info(capsys, tmp_path / "angles.npz")
    assert "joint motion" in text
    assert "10.0 %, interpolated" in text
    assert "100 x 0 x 0 mm" in text
    assert f"next: mjx-hand view {tmp_path / 'angles.npz'}" in text
    pose = np.zeros((FRAMES, 7))
    pose[:, 3] = 1
    description = ObjectDescription(size=np.array([0.02, 0.04, 0.0]), mass=0.08, friction=1.0, kind="cylinder")
    demonstration = Demonstration(
        motion=joint_motion(),
        object_pose=pose,
        object=description,
        support=np.zeros((0, 3)),
        support_position=np.zeros((0, 3)),
        shape=np.zeros(10),
        grasp="power",
    )
    save_demonstration(demonstration, tmp_path / "demo.npz")
    text = info(capsys, tmp_path / "demo.npz")
    assert "power" in text
    assert "cylinder, 20 x 40 mm" in text
    assert "80 g" in text


def test_keypoints(tmp_path, capsys):
    positions = keypoints_of(grip())
    positions[:15, 8] = np.nan
    save_keypoints(KeypointRecording(fps=FPS, positions=positions, source="made"), tmp_path / "hand.npz")
    text = info(capsys, tmp_path / "hand.npz")
    assert "right (as its fingers bend)" in text
    assert "21 of 21, layout mediapipe" in text
    assert "1.2 %" in text
    assert f"next: mjx-hand keypoints {tmp_path / 'hand.npz'} --out hand.motion.npz" in text
    np.savez(tmp_path / "norate.npz", joints=keypoints_of(grip()))
    assert "at a rate that the file does not say; 30/s below is an example" in info(capsys, tmp_path / "norate.npz")
    assert "60 at 25/s" in info(capsys, tmp_path / "norate.npz", "--fps", "25")


def test_real_recordings(recordings, capsys):
    leap = recordings / "leap_motion"
    assert "20 of 21, layout leap, never wrist" in info(capsys, leap / "pinch.npz")
    text = info(capsys, leap / "confidence-37fps.npz")
    assert "right_28+right_30+right_31 (" in text
    assert "choose with --side or --sequence" in text
    assert "found again as right_30, right_31" in info(capsys, leap / "confidence-37fps.npz", "--side", "right")
    assert "393 at" in info(capsys, leap / "confidence-37fps.npz", "--sequence", "right_31")
    text = info(capsys, recordings / "dexmv_mustard" / "sequence.npz")
    assert "DexMV" in text
    assert "the subject's own joint centres" in text
    for suffix in ("c3d", "trc", "tsv"):
        text = info(capsys, recordings / "dfki_glove" / f"recording.{suffix}")
        assert "6000 at 100/s (60.0 s)" in text
        assert "thumb_tip 8.2 %" in text
        assert "--markers glove13 --out recording.motion.npz" in text
    assert "next: mjx-hand track" in info(capsys, recordings / "mediapipe_video" / "human_hand_video.mp4")
    assert "nothing that is known here, but a binary .stl file of " in refused(
        capsys, recordings / "dexmv_mustard" / "mustard_bottle.stl"
    )


def test_marker_files_say_how_to_fit_them(tmp_path, capsys):
    """Two hands in a file, one without a unit, and one whose unit is wrong."""
    names = included_marker_set(load_hand(), "hand22").names
    positions = np.random.default_rng(0).uniform(0, 200, (3, len(names), 3))
    columns = [f"{side}{n}_{axis}" for side in ("L_", "R_") for n in names for axis in "xyz"]
    rows = [",".join(map(str, [*row.ravel(), *(row.ravel() + 500)])) for row in positions]
    path = tmp_path / "two.csv"
    path.write_text("\n".join(["# rate: 100", ",".join(columns), *rows]))
    assert "no unit" in refused(capsys, path)
    text = info(capsys, path, "--units", "mm")
    assert "hand22, of whose markers it has 100 % after 'L_'; labels begin with L_, R_" in text
    assert f"next: mjx-hand fit {path} --markers hand22 --prefix L_ --units mm --out two.motion.npz" in text
    assert "no capture volume is this large" in info(capsys, path, "--units", "m")


def test_a_recording_that_takes_a_choice_is_no_success(tmp_path, capsys):
    np.savez(tmp_path / "row.npz", mano=np.zeros((2, 61)), joint_transforms=np.zeros((2, 1)), joint_transform_order="x")
    assert main(["info", str(tmp_path / "row.npz")]) == 1
    assert "to read it" in capsys.readouterr().out


def test_robots(tmp_path, capsys):
    urdf = "<robot name='arm'><link name='a'/><link name='b'/><joint name='j' type='revolute'/></robot>"
    (tmp_path / "arm.urdf").write_text(urdf)
    text = info(capsys, tmp_path / "arm.urdf")
    assert "URDF of the robot 'arm'" in text
    assert "1 that move" in text
    (tmp_path / "hand.xml").write_text("<mujoco model='h'><worldbody><body><joint/></body></worldbody></mujoco>")
    assert "MJCF of the model 'h'" in info(capsys, tmp_path / "hand.xml")
    (tmp_path / "page.xml").write_text("<html/>")
    assert "XML of 'html', neither a URDF" in refused(capsys, tmp_path / "page.xml")
    (tmp_path / "cut.urdf").write_text("<robot")
    assert "not readable XML" in refused(capsys, tmp_path / "cut.urdf")


def test_what_is_not_known(tmp_path, capsys):
    assert "no such file" in refused(capsys, tmp_path / "absent.npz")
    (tmp_path / "empty.npz").touch()
    assert "the file is empty" in refused(capsys, tmp_path / "empty.npz")
    np.savez(tmp_path / "stock.npz", prices=np.zeros(3))
    assert "nothing that is known here" in refused(capsys, tmp_path / "stock.npz")
    np.savez(tmp_path / "old.npz", schema="mjx-hand/demonstration/0", angles=np.zeros(3))
    assert "schema mjx-hand/demonstration/0, which this version" in refused(capsys, tmp_path / "old.npz")
    (tmp_path / "note.txt").write_text("hello")
    assert "nothing that is known here" in refused(capsys, tmp_path / "note.txt")
    (tmp_path / "cut.npz").write_bytes(b"PK\x03\x04nonsense")
    assert "not a readable" in refused(capsys, tmp_path / "cut.npz")
    assert "nothing that is known here" in refused(capsys, tmp_path)


@pytest.mark.parametrize("side", ["right", "left"])
def test_mano_files(tmp_path, capsys, side):
    hand = load_hand(side=side)
    (tmp_path / "MANO.pkl").write_bytes(official(hand))
    for path in (tmp_path / "MANO.pkl", write_npz(hand, tmp_path / "mano.npz")):
        text = info(capsys, path)
        assert "MANO hand" in text
        assert f"{side}, {hand.num_vertices} vertices" in text
        assert f"--side {side} --mano {path}" in text
