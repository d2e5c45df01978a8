"""Marker files: the same recording in each format, and files that cannot be used."""

import struct
import warnings
from pathlib import Path

import ezc3d
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjx_hand.capture.load_markers import load_markers
from mjx_hand.capture.marker_files.c3d import screen_axes
from mjx_hand.capture.marker_files.marker_format import marker_formats
from mjx_hand.capture.recording import MarkerRecording, save_recording
from mjx_hand.errors import InputError

NAMES = ("hand_back", "Å tip", "nail.3")
FPS = 120.0


@pytest.fixture(scope="module")
def millimetres() -> np.ndarray:
    """Five frames with gaps; to three decimals, as text formats write them."""
    positions = np.random.default_rng(0).uniform(-900, 900, (5, 3, 3)).round(3)
    positions[1:3, 0] = np.nan
    positions[4, 2] = np.nan
    return positions


def write_c3d(path: Path, positions: np.ndarray, names=NAMES, units="mm", **point) -> Path:
    """By another project's writer; a gap is NaN there."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [FPS]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    file["parameters"]["POINT"]["UNITS"]["value"] = [units]
    for key, value in point.items():
        file.add_parameter("POINT", key, [value])
    data = np.ones((4, len(names), len(positions)))
    data[:3] = positions.transpose(2, 1, 0)
    file["data"]["points"] = data
    file.write(str(path))
    return path


def write_tsv(path: Path, positions: np.ndarray, names=NAMES, gap="nan", table_head=True) -> Path:
    rows = [f"NO_OF_FRAMES\t{len(positions)}", f"NO_OF_MARKERS\t{len(names)}", f"FREQUENCY\t{FPS:g}"]
    rows.append("\t".join(["MARKER_NAMES", *names]))
    if table_head:
        rows.append("\t".join(["Frame", "Time", *(f"{n} {axis}" for n in names for axis in "XYZ")]))
    for k, frame in enumerate(positions):
        cells = [gap if np.isnan(v) else f"{v:.3f}" for v in frame.ravel()]
        rows.append("\t".join([str(k + 1), f"{k / FPS:.5f}", *cells] if table_head else cells))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def write_trc(path: Path, positions: np.ndarray, names=NAMES, units="mm", promised=None) -> Path:
    keys = {"DataRate": FPS, "CameraRate": FPS, "NumFrames": promised or len(positions), "NumMarkers": len(names)}
    keys |= {"Units": units}
    rows = ["PathFileType\t4\t(X/Y/Z)\tfile.trc", "\t".join(keys), "\t".join(map(str, keys.values()))]
    rows.append("Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t")
    rows += ["\t\t" + "\t".join(f"{axis}{k + 1}" for k in range(len(names)) for axis in "XYZ"), ""]
    for k, frame in enumerate(positions):
        cells = ["" if np.isnan(v) else f"{v:.3f}" for v in frame.ravel()]
        rows.append("\t".join([str(k + 1), f"{k / FPS:.5f}", *cells]).rstrip("\t"))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def write_csv(path: Path, positions: np.ndarray, names=NAMES, head="# units: mm\n# rate: 120\n") -> Path:
    columns = [f"{n}_{axis}" for n in names for axis in "xyz"]
    rows = [",".join("" if np.isnan(v) else f"{v:.3f}" for v in frame.ravel()) for frame in positions]
    path.write_text(head + "\n".join([",".join(columns), *rows]) + "\n", encoding="utf-8")
    return path


WRITERS = {"c3d": write_c3d, "tsv": write_tsv, "trc": write_trc, "csv": write_csv}


def check_same(recording: MarkerRecording, millimetres: np.ndarray) -> None:
    seen = np.asarray(np.isfinite(millimetres).all(axis=2))
    np.testing.assert_array_equal(recording.visible, seen)
    np.testing.assert_allclose(recording.positions, np.where(seen[..., None], 0.001 * millimetres, 0.0), atol=1e-7)
    assert recording.fps == pytest.approx(FPS)


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


def test_points_of_negative_residual_are_gaps(tmp_path, millimetres):
    path = write_c3d(tmp_path / "r.c3d", np.where(np.isnan(millimetres), 7.0, millimetres))
    content = bytearray(path.read_bytes())
    start = (struct.unpack_from("<H", content, 16)[0] - 1) * 512
    for frame, marker in np.argwhere(np.isnan(millimetres).any(axis=2)):
        struct.pack_into("<f", content, start + 16 * (frame * len(NAMES) + marker) + 12, -1.0)
    path.write_bytes(content)
    check_same(load_markers(path), millimetres)


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
    with pytest.raises(InputError, match="'Time' are not evenly spaced"):
        load_markers(path)


@given(st.permutations([0, 1, 2]), st.lists(st.sampled_from("+-"), min_size=2, max_size=2))
def test_screen_axes_turn_what_was_up_to_z(order, signs):
    right, up = (s + "XYZ"[k] for s, k in zip(signs, order, strict=False))
    turn = screen_axes(Path("f"), right, up)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    for name, expected in ((right, [1, 0, 0]), (up, [0, 0, 1])):
        vector = (1 if name[0] == "+" else -1) * np.eye(3)["XYZ".index(name[1])]
        np.testing.assert_array_equal(turn @ vector, expected)


def test_c3d_with_y_up_is_turned(tmp_path, millimetres):
    path = write_c3d(tmp_path / "r.c3d", millimetres, X_SCREEN="+X", Y_SCREEN="+Y")
    found = load_markers(path).positions[0] * 1000
    np.testing.assert_allclose(found, millimetres[0][:, [0, 2, 1]] * [1, -1, 1], atol=1e-3)
    np.testing.assert_array_equal(screen_axes(path, "", ""), np.eye(3))
    with pytest.raises(InputError, match=r"X_SCREEN is \+X and Y_SCREEN -X"):
        screen_axes(path, "+X", "-X")


def test_c3d_that_is_cut_off_or_of_another_byte_order(tmp_path, millimetres):
    whole = write_c3d(tmp_path / "r.c3d", np.tile(millimetres, (400, 1, 1))).read_bytes()
    broken = tmp_path / "broken.c3d"

    processor = bytearray(whole)
    processor[512 + 3] = 86
    for content, message in (
        (whole[:-4000], "bytes are there; the file is truncated"),
        (whole[:700], "cut off in its header"),
        (b"hello" * 500, "not a C3D file"),
        (bytes(processor), "header says big-endian, but its numbers are little-endian"),
        (b"", "the file is empty"),
    ):
        broken.write_bytes(content)
        with pytest.raises(InputError, match=message):
            load_markers(broken)


def c3d_by_hand(order: str, scale: float, frames: np.ndarray, processor: int, float_bytes) -> bytes:
    """A C3D file from its manual: one point "p" at 100/s in millimetres, coordinates and residual a frame."""

    def parameter(name: str, kind: int, dimensions: list[int], data: bytes) -> bytes:
        body = struct.pack("bB", kind, len(dimensions)) + bytes(dimensions) + data + b"\0"
        return struct.pack("bb", len(name), 1) + name.encode() + struct.pack(order + "h", len(body) + 2) + body

    group = struct.pack("bb", 5, -1) + b"POINT" + struct.pack(order + "h", 3) + b"\0"
    body = parameter("LABELS", -1, [4, 1], b"p   ") + parameter("UNITS", -1, [2], b"mm")
    body += parameter("RATE", 4, [], float_bytes(100.0))
    section = bytes([1, 80, 1, processor]) + group + body
    head = struct.pack(order + "HHHHH", 1, 0, 1, len(frames), 10) + float_bytes(scale) + struct.pack(order + "HH", 3, 0)
    data = frames.astype(order + "i2").tobytes() if scale > 0 else b"".join(map(float_bytes, frames.ravel()))
    return (bytes([2, 0x50]) + head).ljust(512, b"\0") + section.ljust(512, b"\0") + data


def vax(value: float) -> bytes:
    """VAX F floating point: four times the number in IEEE 754, its two words the other way round."""
    content = struct.pack("<f", 4 * value)
    return content[2:] + content[:2]


@pytest.mark.parametrize(
    ("order", "processor", "float_bytes"),
    [
        ("<", 84, lambda v: struct.pack("<f", v)),
        (">", 86, lambda v: struct.pack(">f", v)),
        ("<", 85, vax),
    ],
)
@pytest.mark.parametrize("scale", [0.5, -1.0])
def test_c3d_of_every_processor_as_integers_and_floating_point(tmp_path, order, processor, float_bytes, scale):
    frames = np.array([[100, -200, 300, 0], [1, 2, 3, -1], [0, 0, 0, 0], [4, 5, -6, 5]])
    path = tmp_path / "r.c3d"
    path.write_bytes(c3d_by_hand(order, scale, frames, processor, float_bytes))
    recording = load_markers(path)
    assert (recording.names, recording.fps) == (("p",), 100.0)
    np.testing.assert_array_equal(recording.visible[:, 0], [True, False, False, True])
    expected = frames[[0, 3], :3] * (0.5 if scale > 0 else 1.0) / 1000
    np.testing.assert_allclose(recording.positions[[0, 3], 0], expected, rtol=1e-6)
    content = bytearray(path.read_bytes())
    content[512 + 3] = {84: 86, 85: 86, 86: 84}[processor]
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"but its numbers are (little|big)-endian|header makes no sense"):
        load_markers(path)


def test_c3d_of_more_frames_than_its_header_can_count(tmp_path):
    positions = np.tile(np.arange(1.0, 70001.0)[:, None, None], (1, 1, 3))
    recording = load_markers(write_c3d(tmp_path / "long.c3d", positions, ("p",)))
    assert recording.num_frames == 70000
    np.testing.assert_allclose(recording.positions[:, 0, 0], positions[:, 0, 0] / 1000)


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
        ("tsv", "nail.3", "hand_back", "marker names repeat: hand_back"),
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
        ("csv", "nail.3_", "hand_back_", "names repeat: hand_back"),
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
