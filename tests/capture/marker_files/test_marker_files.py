"""Marker files: the same recording in each format, and files that cannot be used."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.capture.marker_files.marker_format import marker_formats
from mjx_hand.capture.markers.marker_recording import save_recording
from mjx_hand.errors import InputError
from tests.capture.marker_files.written import (
    FPS,
    NAMES,
    WRITERS,
    check_same,
    write_c3d,
    write_csv,
    write_trc,
    write_tsv,
)


@pytest.mark.parametrize("suffix", WRITERS)
def test_every_format_reads_what_was_written(tmp_path, millimetres, suffix):
    recording = load_markers(WRITERS[suffix](tmp_path / f"r.{suffix}", millimetres))
    check_same(recording, millimetres)
    assert recording.names == NAMES
    assert recording.source == f"r.{suffix}"


def test_the_projects_own_file(tmp_path, millimetres):
    recording = load_markers(write_trc(tmp_path / "r.trc", millimetres))
    save_recording(recording, tmp_path / "r.npz")
    check_same(load_markers(tmp_path / "r.npz"), millimetres)
    with pytest.raises(InputError, match="in metres; leave --units out"):
        load_markers(tmp_path / "r.npz", "mm")


def test_every_format_is_listed():
    suffixes = {suffix for known in marker_formats() for suffix in known.suffixes}
    assert suffixes == {".c3d", ".csv", ".npz", ".trc", ".tsv"}
    assert len(marker_formats()) == 6  # two of them are .csv


def test_the_gloves_three_files_hold_one_recording(recordings):
    original, *transcodes = (load_markers(recordings / "dfki_glove" / f"recording.{s}") for s in ("tsv", "c3d", "trc"))
    assert (original.num_frames, len(original.names), original.fps) == (6000, 21, 100.0)
    assert original.names[3] == "thumb_tip"
    assert (~original.visible[:, 3]).mean() == pytest.approx(0.082, abs=0.001)
    np.testing.assert_allclose(original.positions[0, 0], [0.110406, 0.135075, 0.460584], atol=1e-9)
    for other in transcodes:
        assert (other.names, other.fps) == (original.names, original.fps)
        np.testing.assert_array_equal(other.visible, original.visible)
        np.testing.assert_allclose(other.positions, original.positions, atol=1e-7)  # C3D is single precision


@pytest.mark.parametrize(("units", "scale"), [("m", 1.0), ("cm", 0.01), ("Meters", 1.0), ("millimetres", 0.001)])
def test_units_of_the_file_and_of_the_caller(tmp_path, millimetres, units, scale):
    for path in (
        write_trc(tmp_path / "r.trc", millimetres, units=units),
        write_c3d(tmp_path / "r.c3d", millimetres, units=units),
        write_csv(tmp_path / "r.csv", millimetres, head=f"# units: {units}\n# rate: 120\n"),
    ):
        np.testing.assert_allclose(load_markers(path).positions[0], scale * millimetres[0], rtol=1e-6)
        np.testing.assert_allclose(load_markers(path, "mm").positions[0], millimetres[0] / 1000, rtol=1e-6)


def test_zeros_are_gaps(tmp_path, millimetres):
    for suffix, write in WRITERS.items():
        check_same(load_markers(write(tmp_path / f"z.{suffix}", np.nan_to_num(millimetres))), millimetres)


def test_qualisys_variants(tmp_path, millimetres):
    check_same(load_markers(write_tsv(tmp_path / "a.tsv", millimetres, gap="")), millimetres)
    check_same(load_markers(write_tsv(tmp_path / "b.tsv", millimetres, table_head=False)), millimetres)
    path = write_tsv(tmp_path / "c.tsv", millimetres)
    path.write_bytes(path.read_text(encoding="utf-8").replace("\n", "\r\n").encode("cp1252"))
    assert load_markers(path).names == NAMES


def test_csv_rate_from_its_times(tmp_path, millimetres):
    path = tmp_path / "r.csv"
    rows = [
        ",".join([f"{k / FPS:.3f}", *(f"{v:.3f}" for v in np.nan_to_num(f).ravel())]) for k, f in enumerate(millimetres)
    ]
    head = ",".join(["Time", *(f"{n}_{axis}" for n in NAMES for axis in "XYZ")])
    path.write_text("\n".join(["# units: mm", head, *rows]))
    assert load_markers(path).fps == pytest.approx(FPS, rel=0.02)  # times are rounded to a millisecond
    path.write_text("\n".join(["# units: mm", head, rows[0], *rows[2:]]))
    found = load_markers(path)  # the row that is not there is a gap
    assert found.num_frames == len(rows)
    assert not found.visible[1].any()


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_damaged_files_never_raise_anything_else(tmp_path_factory, millimetres, data):
    """Bytes flipped in the first blocks, or the file cut: a recording or one line."""
    folder = tmp_path_factory.mktemp("damaged")
    suffix = data.draw(st.sampled_from(["c3d", "tsv", "trc", "csv"]))
    path = WRITERS[suffix](folder / f"r.{suffix}", millimetres)
    content = bytearray(path.read_bytes())
    for at in data.draw(st.lists(st.integers(0, min(len(content), 520) - 1), max_size=3)):
        content[at] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(1, len(content)))])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read_or_refused(path)


def read_or_refused(path: Path) -> bool:
    """Whether a file gives a sound recording, or one line that says why not."""
    try:
        recording = load_markers(path)
    except InputError as error:
        return "\n" not in str(error)
    return bool(np.isfinite(recording.positions).all())


@pytest.mark.parametrize(
    ("suffix", "old", "new", "message"),
    [
        ("tsv", "FREQUENCY", "FREQ", "not a Qualisys TSV .no FREQUENCY"),
        ("tsv", "FREQUENCY\t120", "FREQUENCY\t0", "FREQUENCY is '0'"),
        ("tsv", "NO_OF_FRAMES\t5", "NO_OF_FRAMES\t9", "5 of 9 frames are there; the file is truncated"),
        ("tsv", "NO_OF_MARKERS\t3", "NO_OF_MARKERS\t4", "3 marker names for 4 markers"),
        ("tsv", "\t0.00833\t", "\t0.00833\tx\t", "line 7 has 12 columns, expected 11"),
        ("tsv", "\t0.00833\t", "\tzwei\t", "line 7: 'zwei' is not a number"),
        ("trc", "PathFileType", "Path", "not a TRC file"),
        ("trc", "\tmm", "\tfurlong", "unit 'furlong' is unknown; valid are m, cm, mm, in"),
        ("trc", "DataRate", "Rate", "lacks DataRate"),
        ("csv", "# units: mm", "#", "no unit; add a line '# units: mm'"),
        ("csv", "# rate: 120", "#", "no frame rate; add a line"),
        ("csv", "hand_back_y", "hand_back_q", "column 'hand_back_q' is unknown"),
        ("trc", "hand_back\t\t\tÅ tip", "nail.3\t\t\tnail.3", "none of its 3 markers has a label of its own"),
    ],
)
def test_bad_text_files_are_refused(tmp_path, millimetres, suffix, old, new, message):
    path = WRITERS[suffix](tmp_path / f"r.{suffix}", millimetres)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_markers(path)


def test_nothing_in_it(tmp_path, millimetres):
    for suffix, write in WRITERS.items():
        with pytest.raises(InputError, match="none of its 3 markers is seen in any of 5 frames"):
            load_markers(write(tmp_path / f"none.{suffix}", np.full_like(millimetres, np.nan)))
    for suffix in ("tsv", "csv"):
        with pytest.raises(InputError, match=r"no frames in it|NO_OF_FRAMES is '0'"):
            load_markers(WRITERS[suffix](tmp_path / f"short.{suffix}", millimetres[:0]))
    with pytest.raises(InputError, match="no such file"):
        load_markers(tmp_path / "absent.c3d")
    with pytest.raises(InputError, match="a folder"):
        load_markers(tmp_path)
    (tmp_path / "r.xyz").write_text("1 2 3")
    with pytest.raises(InputError, match=r"suffix .xyz is not a marker file's; read are C3D"):
        load_markers(tmp_path / "r.xyz")
