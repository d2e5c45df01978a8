"""`mjx-hand retarget` with its options, on one recording and on folders."""

import csv

import numpy as np
import pytest

from mjx_hand.cli.main import main
from mjx_hand.motion import load_joint_motion, save_motion
from mjx_hand.retarget.hands import KinematicHands
from tests.cli.test_retarget import made_motion


@pytest.fixture
def motion(tmp_path):
    save_motion(made_motion(), tmp_path / "motion.npz")
    return tmp_path / "motion.npz"


def test_options_change_the_angles_and_are_said(motion, tmp_path, capsys):
    assert main(["retarget", str(motion), "--out", str(tmp_path / "plain.npz")]) == 0
    capsys.readouterr()
    out = tmp_path / "all.npz"
    options = ["--carry", "--limits", "--refine", "tips", "--smooth", "4", "--plot", str(tmp_path / "errors.png")]
    assert main(["retarget", str(motion), "--out", str(out), *options]) == 0
    printed = capsys.readouterr().out
    assert "exact, carry, limits, refined, below 4 Hz" in printed
    assert "error of the hinges, anatomical axes" in printed
    assert (tmp_path / "errors.png").read_bytes().startswith(b"\x89PNG")
    plain, found = load_joint_motion(tmp_path / "plain.npz").angles, load_joint_motion(out).angles
    rigid = KinematicHands().of(made_motion())
    assert np.all(found >= rigid.hinge_lower - 1e-5)
    assert np.all(found <= rigid.hinge_upper + 1e-5)
    assert np.abs(found - plain).max() > 0.01


def test_getting_ready_is_said_only_where_it_took_time(motion, tmp_path, capsys):
    for _ in range(2):
        assert main(["retarget", str(motion), "--out", str(tmp_path / "x.npz")]) == 0
    again = capsys.readouterr().out.split("load it with")[1]
    assert "122 frames in" in again
    assert "compiling" not in again


def test_functional_axes_follow_a_real_recording_better(recordings, tmp_path, capsys):
    means = {}
    for axes in ("anatomical", "functional"):
        arguments = [str(recordings / "dexmv_mustard/sequence.npz"), "--out", str(tmp_path / "x.npz"), "--axes", axes]
        assert main(["retarget", *arguments]) == 0
        printed = capsys.readouterr().out
        assert f"{axes} axes" in printed
        line = next(row for row in printed.splitlines() if "one-hinge joints" in row)
        means[axes] = float(line.split("│")[2])
    assert means["functional"] < 0.5 * means["anatomical"]


def test_a_folder_with_a_bad_file_ends_with_status_1(motion, tmp_path, capsys):
    (tmp_path / "in").mkdir()
    motion.rename(tmp_path / "in" / "good.npz")
    (tmp_path / "in" / "bad.npz").write_bytes(b"nothing")
    arguments = ["retarget", str(tmp_path / "in"), "--out", str(tmp_path / "out")]
    assert main(arguments) == 1
    printed = capsys.readouterr().out
    assert "1 recordings, 122 frames, 10 in gaps" in printed
    assert "bad.npz: not a readable .npz file" in printed
    assert "1 of 2 recordings could not be used; exit status 1" in printed
    with (tmp_path / "out" / "summary.csv").open(newline="") as file:
        assert [row["status"] for row in csv.DictReader(file)] == ["failed", "done"]
    (tmp_path / "in" / "bad.npz").unlink()
    assert main(arguments) == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--axes", "best"], "axes is 'best'"),
        (["--smooth", "0"], "smooth is 0.0 Hz"),
        (["--smooth", "40"], "cut-off is 40.0 Hz; for 60 frames/s"),
        (["--plot", "errors.gif"], "figures are written as .png"),
        (["--pattern", "*.npz", "--plot", "x.png"], "--plot is for one recording"),
    ],
)
def test_options_that_cannot_be_are_one_line(motion, tmp_path, capsys, options, message):
    assert main(["retarget", str(motion), "--out", str(tmp_path / "x.npz"), *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
