"""`mjx-hand retarget`, on a real recording, on one with gaps, and on files that cannot be used."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.cli.main import main
from mjx_hand.files.npz_archive import save_arrays
from mjx_hand.motion import Motion, load_joint_motion, save_motion
from mjx_hand.motion.motion import SCHEMA

FRAMES = 122  # as the real recording, so that both share one compilation


def made_motion() -> Motion:
    """A hand that closes: every finger joint turns a little about +z, the wrist moves along x; frames 40-49 lost."""
    turn = np.zeros((FRAMES, 15, 3))
    turn[..., 2] = np.linspace(0, 0.8, FRAMES)[:, None]
    rotations = Rotation.from_rotvec(turn.reshape(-1, 3)).as_matrix().reshape(FRAMES, 15, 3, 3)
    valid = np.ones(FRAMES, bool)
    valid[40:50] = False
    rotations[~valid] = np.eye(3)
    position = np.linspace([0, 0, 0], [1.0, 0, 0], FRAMES)
    return Motion(
        fps=60.0,
        rotations=rotations,
        wrist_position=np.where(valid[:, None], position, 0.0),
        wrist_quaternion=np.tile([1.0, 0, 0, 0], (FRAMES, 1)),
        shape=np.zeros(10),
        valid=valid,
        source="made [b]motion[/b]",
    )


def test_real_recording(recordings, tmp_path, capsys):
    out = tmp_path / "angles.npz"
    assert main(["retarget", str(recordings / "dexmv_mustard/sequence.npz"), "--out", str(out)]) == 0
    motion = load_joint_motion(out)
    assert motion.num_frames == FRAMES
    assert np.isfinite(motion.angles).all()
    printed = capsys.readouterr().out
    assert "122 frames at 25/s (4.9 s), 0 in gaps" in printed
    assert "rotation, two-hinge joints (degrees)" in printed
    assert "finger-tip position (mm)" in printed


def test_gaps_are_marked_and_bridged(tmp_path, capsys):
    save_motion(made_motion(), tmp_path / "motion.npz")
    assert main(["retarget", str(tmp_path / "motion.npz"), "--out", str(tmp_path / "angles.npz")]) == 0
    assert "made [b]motion[/b]: 122 frames" in capsys.readouterr().out  # names are printed as they are
    found = load_joint_motion(tmp_path / "angles.npz")
    assert np.flatnonzero(~found.valid).tolist() == list(range(40, 50))
    np.testing.assert_allclose(found.wrist_position[:, 0], np.linspace(0, 1, FRAMES), atol=1e-6)
    straight = np.linspace(found.angles[39], found.angles[50], 12)
    np.testing.assert_allclose(found.angles[39:51], straight, atol=1e-6)


def unusable(folder: Path) -> dict[str, tuple[Path, str]]:
    """Files that cannot be retargeted, and what the command must say about each."""
    sound = {k: v for k, v in vars(made_motion()).items() if v is not None}
    rotations = sound["rotations"]
    empty = {"rotations": rotations[:0], "valid": np.zeros(0, bool)}
    empty |= {"wrist_position": np.zeros((0, 3)), "wrist_quaternion": np.zeros((0, 4))}
    changes = {
        "skewed": ({"rotations": rotations * 1.2}, "not rotations"),
        "nan": ({"rotations": np.where(np.arange(3) == 1, np.nan, rotations)}, "NaN"),
        "vectors": ({"rotations": np.zeros((FRAMES, 45))}, "rotations has shape (122, 45)"),
        "short": ({"wrist_position": np.zeros((3, 3))}, "wrist_position has shape (3, 3)"),
        "empty": (empty, "no frames"),
        "side": ({"side": "middle"}, "side is 'middle'"),
    }
    files = {}
    for name, (change, message) in changes.items():
        save_arrays(folder / f"{name}.npz", SCHEMA, sound | change)
        files[name] = (folder / f"{name}.npz", message)
    (folder / "film.mp4").write_bytes(b"\x00\x00\x00\x18ftypmp42")
    (folder / "zero.npz").touch()
    np.savez(folder / "other.npz", stuff=np.zeros(3))
    files["missing"] = (folder / "gone.npz", "no such file")
    files["film"] = (folder / "film.mp4", "not a recording that is")
    files["zero"] = (folder / "zero.npz", "the file is empty")
    files["other"] = (folder / "other.npz", "an .npz of stuff")
    return files


CASES = ("skewed", "nan", "vectors", "short", "empty", "side", "missing", "film", "zero", "other")


@pytest.mark.parametrize("case", CASES)
def test_unusable_recordings_are_one_line_status_2_and_no_output(tmp_path, capsys, case):
    path, message = unusable(tmp_path)[case]
    before = sorted(tmp_path.iterdir())
    assert main(["retarget", str(path), "--out", str(tmp_path / "out.npz")]) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith(f"mjx-hand: {path}")
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert printed.out == ""
    assert sorted(tmp_path.iterdir()) == before


def test_output_that_cannot_be_written_and_unknown_method(tmp_path, capsys):
    save_motion(made_motion(), tmp_path / "motion.npz")
    (tmp_path / "file").touch()
    for arguments, message in [
        (["--out", str(tmp_path / "file" / "x.npz")], "cannot write"),
        (["--out", str(tmp_path)], "is a folder"),
        (["--out", str(tmp_path / "x.npz"), "--method", "guess"], "method 'guess'"),
    ]:
        assert main(["retarget", str(tmp_path / "motion.npz"), *arguments]) == 2
        printed = capsys.readouterr()
        assert message in printed.err
        assert printed.err.count("\n") == 1
        assert printed.out == ""
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "motion.npz"]


def test_installed_command_exits_with_2_and_says_one_line(tmp_path):
    command = Path(sys.executable).with_name("mjx-hand")
    done = subprocess.run(
        [command, "retarget", "gone.npz", "--out", "x.npz"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "mjx-hand: gone.npz: no such file; give the path of a recording\n"


def test_output_that_would_replace_the_recording(tmp_path, capsys):
    path = tmp_path / "motion.npz"
    save_motion(made_motion(), path)
    before = path.read_bytes()
    assert main(["retarget", str(path), "--out", str(tmp_path / "." / "motion.npz")]) == 2
    assert "is what is read; give another --out" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_options_and_outputs_that_do_not_go_with_the_recording(tmp_path, capsys):
    path, folder = tmp_path / "motion.npz", tmp_path / "folder"
    folder.mkdir()
    save_motion(made_motion(), path)
    for recording, options, message in (
        (path, ["--out", "a.npz", "--pattern", "*.npz"], "is a file; --pattern chooses"),
        (path, ["--out", "a.txt"], "name it a.npz"),
        (path, ["--out", "a.npz", "--plot", "a.bmp"], "figures are written as"),
        (folder, ["--out", str(path)], "choose a folder for their outputs"),
    ):
        assert main(["retarget", str(recording), *options]) == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1
