"""Marker files that are not as their header says: rows left out, unnamed trajectories, labels that repeat."""

import numpy as np
import pytest

from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.errors import InputError
from tests.capture.marker_files.written import FPS, NAMES, WRITERS, check_same, write_csv, write_trc, write_tsv


@pytest.fixture(scope="module")
def places() -> np.ndarray:
    """Twenty frames of the three markers (mm)."""
    return 100.0 + np.arange(20)[:, None, None] + np.arange(9.0).reshape(3, 3) * 10


def without_rows(path, first: int, last: int):
    """The file without the rows from `first` to before `last`, counted from its last line."""
    lines = path.read_text(encoding="utf-8").splitlines()
    head = len(lines) - 20
    text = "\n".join(lines[: head + first] + lines[head + last :]) + "\n"
    path.write_text(text.replace("NO_OF_FRAMES\t20", "NO_OF_FRAMES\t16").replace("\t20\t3\t", "\t16\t3\t"), "utf-8")
    return path


@pytest.mark.parametrize("suffix", ["trc", "tsv"])
def test_rows_left_out_are_gaps(tmp_path, places, suffix):
    found = load_markers(without_rows(WRITERS[suffix](tmp_path / f"r.{suffix}", places), 8, 12))
    assert (found.fps, found.num_frames, found.warnings) == (FPS, 20, ())
    expected = places.copy()
    expected[8:12] = np.nan
    check_same(found, expected)


@pytest.mark.parametrize("column", ["frame", "time", "Time (ms)"])
def test_a_table_beside_a_rate(tmp_path, places, column):
    path = write_csv(tmp_path / "r.csv", places)
    lines = path.read_text(encoding="utf-8").splitlines()
    scale = {"frame": 1.0, "time": 1 / FPS, "Time (ms)": 1e3 / FPS}[column]
    rows = [f"{k * scale:.6g},{line}" for k, line in enumerate(lines[3:]) if not 8 <= k < 12]
    path.write_text("\n".join([*lines[:2], f"{column},{lines[2]}", *rows]), encoding="utf-8")
    expected = places.copy()
    expected[8:12] = np.nan
    check_same(load_markers(path), expected)


def test_the_rate_of_the_caller(tmp_path, places):
    path = write_csv(tmp_path / "r.csv", places, head="# units: mm\n")
    with pytest.raises(InputError, match=r"no frame rate.*or say it with --fps"):
        load_markers(path)
    assert load_markers(path, fps=50.0).fps == 50.0
    path = write_trc(tmp_path / "r.trc", places)
    with pytest.raises(InputError, match="recorded at 120 frames per second; leave out fps=50"):
        load_markers(path, fps=50.0)


def with_unnamed(path, places, count, promised: int, labels=NAMES, rate=FPS):
    """A TRC as Cortex writes it: in row k `count(k)` trajectories without a name behind the named ones."""
    write_trc(path, places)
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[2] = lines[2].replace("\t3\t", f"\t{promised}\t")
    lines[3] = "Frame#\tTime\t" + "".join(f"{label}\t\t\t" for label in labels)
    for k in range(len(places)):
        lines[6 + k] += "\t" + "\t".join(["7.0"] * 3 * count(k)) if count(k) else ""
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


@pytest.mark.parametrize("promised", [3, 5])
@pytest.mark.parametrize("count", [lambda k: 2, lambda k: k % 3])
def test_unnamed_trajectories_are_passed_over(tmp_path, places, promised, count):
    found = load_markers(with_unnamed(tmp_path / "r.trc", places, count, promised))
    check_same(found, places)
    assert found.names == NAMES
    assert found.warnings == ("up to 2 trajectories without a name are left out",)


def test_an_unnamed_trajectory_among_named_ones(tmp_path, places):
    """A label belongs to the columns below it, not to the next ones."""
    path = with_unnamed(tmp_path / "r.trc", places, lambda k: 0, 3, labels=(NAMES[0], "", NAMES[2]))
    found = load_markers(path)
    assert found.names == (NAMES[0], NAMES[2])
    np.testing.assert_allclose(found.positions, places[:, [0, 2]] / 1e3)


def test_more_names_than_there_are_markers(tmp_path, places):
    path = with_unnamed(tmp_path / "r.trc", places, lambda k: 0, 3, labels=(*NAMES, "more", "still.more"))
    with pytest.raises(InputError, match="5 marker names for NumMarkers 3, and 3 markers in the rows"):
        load_markers(path)
    path = with_unnamed(tmp_path / "r.trc", places, lambda k: 0, 5, labels=(*NAMES, "more", "still.more"))
    assert len(load_markers(path).names) == 5 or "still.more" in load_markers(path).names


@pytest.mark.parametrize("write", [write_tsv, write_trc, WRITERS["c3d"]])
def test_labels_that_repeat_leave_the_others(tmp_path, places, write):
    wide = np.concatenate([places, places[:, :2] + 500], axis=1)
    path = write(tmp_path / f"r.{write.__name__[-3:]}", wide, names=(*NAMES, "HEAD", "HEAD"))
    found = load_markers(path)
    check_same(found, places)
    assert found.names == NAMES
    assert found.warnings == ("markers whose labels repeat are left out: HEAD",)


def test_a_table_whose_columns_repeat(tmp_path, places):
    path = write_csv(tmp_path / "r.csv", places)
    path.write_text(path.read_text(encoding="utf-8").replace("nail.3_", "hand_back_"), encoding="utf-8")
    found = load_markers(path)
    assert found.names == (NAMES[1],)
    np.testing.assert_allclose(found.positions[:, 0], places[:, 1] / 1e3)
    path.write_text(path.read_text(encoding="utf-8").replace("Å tip_", "hand_back_"), encoding="utf-8")
    with pytest.raises(InputError, match="none of its 3 markers has a label of its own, and hand_back repeat"):
        load_markers(path)


def test_a_wide_table_is_read_in_no_time(tmp_path):
    names = [f"m{k}" for k in range(6000)]
    path = write_csv(tmp_path / "r.csv", np.ones((2, 6000, 3)), names=names)
    assert load_markers(path).num_frames == 2  # quadratic in the columns, this took most of a minute
