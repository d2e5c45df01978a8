"""`mjx-hand build --axes-from --limits-from`: the written hand has the person's axes and range."""

import mujoco
import numpy as np
import pytest

from mjx_hand.cli.main import main
from mjx_hand.hand.joints import HINGES
from mjx_hand.motion import Motion, save_motion
from tests.projection.samples import about

FRAMES = 40


@pytest.fixture
def recording(tmp_path):
    """Fingers that bend about a line 20 degrees from +z, by 0 to 50 degrees."""
    axis = np.array([np.sin(np.radians(20)), 0.0, np.cos(np.radians(20))])
    turn = about(np.tile(axis, (FRAMES, 1)), np.linspace(0, np.radians(50), FRAMES))
    motion = Motion(
        fps=30.0,
        rotations=np.repeat(turn[:, None], 15, axis=1),
        wrist_position=np.zeros((FRAMES, 3)),
        wrist_quaternion=np.tile([1.0, 0, 0, 0], (FRAMES, 1)),
        shape=np.zeros(10),
        valid=np.ones(FRAMES, bool),
    )
    save_motion(motion, tmp_path / "person.npz")
    return tmp_path / "person.npz", axis


def test_axes_and_range_are_the_persons(recording, tmp_path, capsys):
    path, axis = recording
    arguments = ["build", "--out", str(tmp_path / "hand"), "--axes-from", str(path), "--limits-from", str(path)]
    assert main(arguments) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert f"axes fitted to {path}: mean error on it 0." in printed
    assert "soft limits: the range of" in printed
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "hand" / "right_hand.xml"))
    for name in ("index_pip_flexion", "ring_dip_flexion"):
        assert np.degrees(np.arccos(model.joint(name).axis @ axis)) < 5
        assert np.degrees(model.joint(name).user[1]) == pytest.approx(55, abs=3)
        assert np.degrees(model.joint(name).range[1]) >= 90
    assert len(HINGES) == model.njnt


def test_unusable_recordings_write_nothing(recording, tmp_path, capsys):
    path, _ = recording
    for arguments, message in (
        (["--axes-from", str(tmp_path / "gone.npz")], "no such file"),
        (["--axes-from", str(path), "--side", "left"], "--side right fits it"),
        (["--limits-from", str(path), "--side", "left"], "--side right fits it"),
    ):
        assert main(["build", "--out", str(tmp_path / "hand"), *arguments]) == 2
        printed = capsys.readouterr()
        assert message in printed.err
        assert printed.err.count("\n") == 1
        assert printed.out == ""
        assert not (tmp_path / "hand").exists()
