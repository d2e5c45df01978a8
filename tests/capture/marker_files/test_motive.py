"""OptiTrack Motive's CSV export."""

import numpy as np
import pytest

from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.cli.main import main
from mjx_hand.errors import InputError

HEAD = (
    "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,120.000000,Export Frame Rate,120.000000,"
    "Total Exported Frames,4,Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global"
)
TYPES = ["Rigid Body"] * 7 + ["Rigid Body Marker"] * 3 + ["Marker"] * 6
NAMES = ["Hand"] * 7 + ["Hand:1"] * 3 + ["Hand:1"] * 3 + ["Hand:2"] * 3
KINDS = ["Rotation"] * 4 + ["Position"] * 12
AXES = ["X", "Y", "Z", "W", *(["X", "Y", "Z"] * 4)]


def write(path, head=HEAD, axes=AXES, numbers=(0, 1, 2, 3)):
    rng = np.random.default_rng(0)
    values = np.round(rng.uniform(100, 900, (4, 16)), 3)
    rows = [f"{k},{k / 120:.6f}," + ",".join(map(str, values[k])) for k in numbers]
    titles = [f",{key}," + ",".join(cells) for key, cells in (("Type", TYPES), ("Name", NAMES), ("ID", ["1"] * 16))]
    lines = [head, "", *titles, ",," + ",".join(KINDS), "Frame,Time (Seconds)," + ",".join(axes), *rows]
    path.write_text("\ufeff" + "\n".join(lines) + "\n", encoding="utf-8")
    return values[:, 10:].reshape(4, 2, 3) / 1e3


def test_measured_markers_are_read(tmp_path):
    places = write(tmp_path / "take.csv")
    found = load_markers(tmp_path / "take.csv")
    assert (found.names, found.fps, found.warnings) == (("Hand:1", "Hand:2"), 120.0, ())
    np.testing.assert_allclose(found.positions, places)


def test_a_frame_that_is_not_there_is_a_gap(tmp_path):
    places = write(tmp_path / "take.csv", numbers=(0, 1, 3))
    found = load_markers(tmp_path / "take.csv")
    assert found.visible.all(axis=1).tolist() == [True, True, False, True]
    np.testing.assert_allclose(found.positions[[0, 1, 3]], places[[0, 1, 3]])
    assert "3 frames where 4 are said to be exported" in found.warnings[0]


def test_what_is_refused(tmp_path):
    path = tmp_path / "take.csv"
    for old, new, message in (
        ("Millimeters", "Furlongs", "unit 'Furlongs' is unknown"),
        ("Frames,4", "Frames,9", "4 of 8 frames are there; the file is truncated"),
        (",Type,", ",Kind,", "lacks Type, Name or Position"),
        ("Frame,Time", "Number,Time", "without its line of columns"),
    ):
        write(path)
        path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
        with pytest.raises(InputError, match=message):
            load_markers(path)


def test_the_export_of_the_documented_header(recordings, capsys):
    path = recordings / "odd_files" / "motive.csv"
    found = load_markers(path)
    assert (found.names, found.fps, found.num_frames) == (("Hand:Thumb1", "Hand:Index1"), 120.0, 2)
    np.testing.assert_allclose(found.positions[0], [[0.1, 0.2, 0.3], [0.1, 0.2, 0.35]])
    assert main(["info", str(path)]) == 0
    assert "Motive" in capsys.readouterr().out
