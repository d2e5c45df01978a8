"""What is doubtful stands in the file, beside the table and in `info`; what is wrong beyond doubt is not written."""

import json

import numpy as np
import pytest

from mjx_hand.cli.main import main
from mjx_hand.motion import load_motion_file
from tests.capture.keypoints.grips import grip, keypoints_of

POINTS = keypoints_of(grip())


def written(path, points, **said):
    path.write_text(json.dumps({"side": "right", "fps": 50, **said, "frames": points.tolist()}))
    return path


def wavering(share: float) -> np.ndarray:
    """The fingers' joints in places that are off by such a share of a bone, anew in each frame."""
    rng = np.random.default_rng(0)
    points = POINTS.copy()
    points[:, 1:] += share * 0.03 * rng.standard_normal(points[:, 1:].shape)
    return points


def test_a_doubtful_recording_is_written_with_a_warning(tmp_path, capsys):
    out = tmp_path / "motion.npz"
    assert main(["keypoints", str(written(tmp_path / "hand.json", wavering(0.15))), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    (warning,) = [w for w in load_motion_file(out).warnings if w.startswith("bone lengths")]
    assert f"warning: {warning}" in said
    assert main(["info", str(out)]) == 0
    assert warning in capsys.readouterr().out


def test_a_good_recording_has_no_warning(tmp_path, capsys):
    out = tmp_path / "motion.npz"
    assert main(["keypoints", str(written(tmp_path / "hand.json", POINTS)), "--out", str(out)]) == 0
    assert "warning" not in capsys.readouterr().out
    assert load_motion_file(out).warnings == ()


def test_what_no_hand_does_is_refused_and_told_by_info(tmp_path, capsys):
    path, out = written(tmp_path / "hand.json", wavering(0.5)), tmp_path / "motion.npz"
    assert main(["keypoints", str(path), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert "bone lengths: vary by" in said
    assert len(said.splitlines()) == 1
    assert not out.exists()
    main(["info", str(path)])
    assert "bone lengths: vary by" in capsys.readouterr().out


def test_what_was_done_about_times_is_told(tmp_path, capsys):
    times = np.repeat(np.arange(30), 2) / 50
    frames = [{"time": t, "joints": p.tolist()} for t, p in zip(times, np.repeat(POINTS[:30], 2, axis=0), strict=True)]
    path, out = tmp_path / "hand.json", tmp_path / "motion.npz"
    path.write_text(json.dumps(frames))
    assert main(["keypoints", str(path), "--side", "right", "--out", str(out)]) == 0
    assert "warning: 30 frames of equal time taken as one" in capsys.readouterr().out
    found = load_motion_file(out)
    assert (found.num_frames, found.fps) == (30, pytest.approx(50))


def test_retarget_passes_warnings_on(tmp_path, capsys):
    folder = tmp_path / "set"
    folder.mkdir()
    main(["keypoints", str(written(tmp_path / "hand.json", wavering(0.15))), "--out", str(folder / "a.npz")])
    main(["keypoints", str(written(tmp_path / "good.json", POINTS)), "--out", str(folder / "b.npz")])
    capsys.readouterr()
    assert main(["retarget", str(folder), "--out", str(tmp_path / "out")]) == 0
    assert "warning: a.npz: bone lengths" in capsys.readouterr().out
    rows = (tmp_path / "out" / "summary.csv").read_text().splitlines()
    assert "bone lengths: vary by" in rows[1]
    assert rows[2].endswith(",")
    assert main(["info", str(tmp_path / "out" / "a.npz")]) == 0
    assert "bone lengths: vary by" in capsys.readouterr().out


def test_points_of_one_place_are_told_before_anything_is_fitted(tmp_path, capsys):
    points = POINTS.copy()
    points[:, 8] = points[:, 7]
    assert main(["keypoints", str(written(tmp_path / "hand.json", points)), "--out", str(tmp_path / "m.npz")]) == 2
    assert "index_dip and index_tip at one place, in 100 % of the frames" in capsys.readouterr().err
