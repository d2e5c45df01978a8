"""`mjx-hand fit`, from a file to a motion, a table and a picture."""

import numpy as np
import pytest
from PIL import Image

from mjx_hand.capture.load import load_motion
from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.capture.markers.marker_recording import MarkerRecording, save_recording
from mjx_hand.capture.markers.marker_set import included_marker_set
from mjx_hand.capture.simulation.simulate import simulate_markers
from mjx_hand.cli.main import main
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import load_motion_file
from mjx_hand.pytree import replace
from tests.capture.grasps import errors, grasp
from tests.capture.marker_files.written import write_c3d


@pytest.fixture(scope="module")
def known():
    """A motion and what a capture system saw of it."""
    hand = load_hand()
    truth = grasp(hand, 0)
    return truth, simulate_markers(hand, truth, included_marker_set(hand), 0)


def write(path, recording: MarkerRecording, names=None, units="mm"):
    """As C3D, with markers that are not on the hand."""
    positions = np.where(recording.visible[..., None], recording.positions * 1000, np.nan)
    positions = np.concatenate([positions, np.full((len(positions), 1, 3), 77.0)], axis=1)
    return write_c3d(path, positions, (*(names or recording.names), "elbow"), units)


def run(capsys, *arguments) -> tuple[int, str, str]:
    status = main(["fit", *map(str, arguments)])
    out = capsys.readouterr()
    return status, out.out, out.err


def test_a_c3d_file_becomes_a_motion(tmp_path, capsys, known):
    truth, recording = known
    file = write(tmp_path / "r.c3d", recording)
    motion_file, picture = tmp_path / "motion.npz", tmp_path / "fit.png"
    status, out, _ = run(capsys, file, "--markers", "hand22", "--out", motion_file, "--plot", picture)
    assert status == 0
    fit = load_motion_file(motion_file)
    assert errors(load_hand(), truth, fit).vertex.mean() < 0.002
    read = load_motion(file, markers="hand22")
    np.testing.assert_allclose(read.rotations, fit.rotations, atol=1e-5)
    with pytest.raises(InputError, match="leave out sequence= and fps="):
        load_motion(file, markers="hand22", fps=120)
    assert "fitting 300 frames: 100 in" in out
    assert "r.c3d: 300 frames at 120/s (2.5 s), 0 in gaps" in out
    assert "wrist_radial" in out
    assert "no marker of the set, left out: elbow" in out
    assert "0 of 300 frames have a joint more than 3° beyond its range" in out
    with Image.open(picture) as image:
        pixels = np.asarray(image.convert("RGB"), float)
    skin = np.abs(pixels - pixels.mean(axis=2, keepdims=True)).max(axis=2) > 15
    assert skin[: len(skin) // 2].mean() > 0.05  # hands above
    assert (pixels.std(axis=2)[len(skin) // 2 :] > 30).mean() > 0.05  # coloured errors below


def test_a_marker_left_out_and_a_known_shape(tmp_path, capsys, known):
    _, recording = known
    file = write(tmp_path / "r.c3d", recording)
    out_file = tmp_path / "motion.npz"
    status, out, _ = run(capsys, file, "--markers", "hand22", "--out", out_file, "--leave-out", "index_nail")
    assert status == 0
    assert "index_nail, left out of the fit, is" in out
    distance = float(out.split("index_nail, left out of the fit, is ")[1].split(" mm")[0])
    assert 0.5 < distance < 12  # unseen by the fit, so further off than the noise
    first = load_motion_file(out_file)
    again = tmp_path / "again.npz"
    assert run(capsys, file, "--markers", "hand22", "--out", again, "--shape", out_file)[0] == 0
    np.testing.assert_allclose(load_motion_file(again).shape, first.shape, atol=0.02)
    assert run(capsys, file, "--markers", "hand22", "--out", again, "--shape", "fixed")[0] == 0
    np.testing.assert_allclose(load_motion_file(again).shape, 0.0, atol=0.02)


def prefixed(recording: MarkerRecording, *starts: str) -> MarkerRecording:
    """The markers of several hands, each label after its hand's."""
    return replace(
        recording,
        positions=np.concatenate([recording.positions] * len(starts), axis=1),
        visible=np.concatenate([recording.visible] * len(starts), axis=1),
        names=tuple(start + name for start in starts for name in recording.names),
    )


def test_recordings_that_cannot_be_fitted_are_named_and_nothing_is_written(tmp_path, capsys, known):
    _, recording = known
    hidden = replace(recording, visible=np.zeros_like(recording.visible), positions=np.zeros_like(recording.positions))
    few = replace(recording, visible=recording.visible & (np.arange(22) < 4))
    few = replace(few, positions=np.where(few.visible[..., None], few.positions, 0.0))
    cases = [
        (
            write(tmp_path / "m.c3d", recording, units="m"),
            [],
            "the hand is about 1000 times too big; millimetres were taken for metres: read it with --units mm",
        ),
        (write(tmp_path / "cm.c3d", recording, units="cm"), [], "the hand is about 10 times too big; check its unit"),
        (write(tmp_path / "two.c3d", prefixed(recording, "R_", "L_")), [], "some are after 'L_', 'R_': say --prefix"),
        (write(tmp_path / "v.c3d", prefixed(recording, "R:", "L:")), [], "are there two hands"),
        (write(tmp_path / "few.c3d", few), [], "no frame shows 8 markers of the set (never seen: index_pip, "),
        (tmp_path / "absent.c3d", [], "no such file"),
        (write(tmp_path / "r.c3d", recording), ["--plot", tmp_path / "fit.gif"], "figures are written as .png"),
        (tmp_path / "r.c3d", ["--shape", "big"], "--shape big: no such file; valid are free, fixed"),
        (tmp_path / "r.c3d", ["--leave-out", "nose"], "no marker 'nose' to leave out"),
        (tmp_path / "r.c3d", ["--fill", "-1"], "expected a number of 0 or more"),
    ]
    save_recording(hidden, tmp_path / "hidden.npz")
    cases.append((tmp_path / "hidden.npz", [], "no frame shows 8 markers"))
    for file, options, message in cases:
        status, _, error = run(capsys, file, "--markers", "hand22", "--out", tmp_path / "no.npz", *options)
        assert (status, message in error, error.count("\n")) == (2, True, 1), (file, error)
    assert not (tmp_path / "no.npz").exists()
    status, _, error = run(capsys, tmp_path / "r.c3d", "--markers", "none.yaml", "--out", tmp_path / "no.npz")
    assert (status, "no such marker set" in error) == (2, True)


def test_a_hand_of_two_by_its_prefix_and_units_of_the_caller(tmp_path, capsys, known):
    truth, recording = known
    file = write(tmp_path / "two.c3d", prefixed(recording, "R_", "L_"), units="m")
    out_file = tmp_path / "motion.npz"
    status, out, _ = run(capsys, file, "--markers", "hand22", "--out", out_file, "--prefix", "R_", "--units", "mm")
    assert status == 0
    assert "left out: L_wrist_radial, L_wrist_ulnar" in out
    assert errors(load_hand(), truth, load_motion_file(out_file)).vertex.mean() < 0.002


def test_the_real_glove(tmp_path, capsys, recordings):
    """A real recording of 13 markers: close to all of them, and no impossible joint."""
    recording = load_markers(recordings / "dfki_glove" / "recording.c3d")
    save_recording(
        replace(recording, fps=25.0, positions=recording.positions[::4], visible=recording.visible[::4]),
        tmp_path / "glove.npz",
    )
    motion_file = tmp_path / "motion.npz"
    status, out, _ = run(capsys, tmp_path / "glove.npz", "--markers", "glove13", "--out", motion_file)
    assert status == 0
    assert "0 of 1500 frames have a joint more than 3° beyond its range" in out
    assert float(out.split("all markers: ")[1].split(" mm")[0]) < 1.0
    assert "left out: right_elbow, back_top" in out
    motion = load_motion_file(motion_file)
    assert motion.valid.all()
    assert 0.5 < motion.shape[0] < 4  # a large hand
