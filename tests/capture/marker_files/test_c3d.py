"""C3D files: gaps, axes, byte orders, number formats, and files that cannot be used."""

import struct
from pathlib import Path

import ezc3d
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjx_hand.capture.marker_files.c3d import screen_axes
from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.errors import InputError
from tests.capture.marker_files.written import NAMES, check_same, write_c3d


def test_points_of_negative_residual_are_gaps(tmp_path, millimetres):
    path = write_c3d(tmp_path / "r.c3d", np.where(np.isnan(millimetres), 7.0, millimetres))
    content = bytearray(path.read_bytes())
    start = (struct.unpack_from("<H", content, 16)[0] - 1) * 512
    for frame, marker in np.argwhere(np.isnan(millimetres).any(axis=2)):
        struct.pack_into("<f", content, start + 16 * (frame * len(NAMES) + marker) + 12, -1.0)
    path.write_bytes(content)
    check_same(load_markers(path), millimetres)


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


def stale(path: Path, frames: int, start: int, end: int) -> np.ndarray:
    """A file of so many frames whose TRIAL group says others, as cropping and joining leave it."""
    places = np.random.default_rng(frames).uniform(100, 900, (frames, 3, 3))
    file = ezc3d.c3d()
    for key, value in {"RATE": [100.0], "UNITS": ["mm"], "LABELS": ["a", "b", "c"]}.items():
        file["parameters"]["POINT"][key]["value"] = value
    file["data"]["points"] = np.concatenate([places.transpose(2, 1, 0), np.ones((1, 3, frames))])
    file.add_parameter("TRIAL", "ACTUAL_START_FIELD", [start, 0])
    file.add_parameter("TRIAL", "ACTUAL_END_FIELD", [end, 0])
    file.write(str(path))
    return places / 1e3


@pytest.mark.parametrize(("frames", "start", "end"), [(240, 1, 480), (240, 241, 960), (480, 1, 240), (3, 1, 4)])
def test_frames_are_those_of_the_file_not_of_before_it_was_cut(tmp_path, frames, start, end):
    places = stale(tmp_path / "r.c3d", frames, start, end)
    np.testing.assert_allclose(load_markers(tmp_path / "r.c3d").positions, places, rtol=1e-6)
    content = (tmp_path / "r.c3d").read_bytes()
    (tmp_path / "r.c3d").write_bytes(content[: len(content) - 512 * (1 + frames // 100)])
    with pytest.raises(InputError, match="the file is truncated"):
        load_markers(tmp_path / "r.c3d")


@pytest.mark.parametrize(("first", "last"), [(0, 3), (0, 4), (1, 4), (0, 119), (0, 120)])
def test_first_frame_zero(tmp_path, first, last):
    """Some writers count from 0; of those some name the last frame, and some how many there are."""
    frames = np.tile([[1, 2, 3, 0], [4, 5, 6, 0], [7, 8, 9, 0], [1, 1, 1, 0]], (30 if last > 100 else 1, 1))
    content = bytearray(c3d_by_hand("<", -1.0, frames, 84, lambda v: struct.pack("<f", v)))
    struct.pack_into("<HH", content, 6, first, last)
    (tmp_path / "r.c3d").write_bytes(content + bytes(-len(content) % 512))
    found = load_markers(tmp_path / "r.c3d")
    assert found.num_frames in (len(frames), last - first + 1)
    if len(frames) > 100:  # in a few frames the last block has room for one more
        np.testing.assert_allclose(found.positions[:120, 0], frames[:, :3] / 1e3, rtol=1e-6)


def without_rate(content: bytes, header: float) -> bytes:
    changed = bytearray(content.replace(b"RATE", b"RATX"))
    struct.pack_into("<f", changed, 20, header)
    return bytes(changed)


def test_the_rate_of_the_header_or_of_the_caller(tmp_path):
    frames = np.array([[1, 2, 3, 0], [4, 5, 6, 0]])
    whole = c3d_by_hand("<", -1.0, frames, 84, lambda v: struct.pack("<f", v))
    path = tmp_path / "r.c3d"
    path.write_bytes(without_rate(whole, 250.0))
    assert (load_markers(path).fps, load_markers(path).warnings) == (250.0, ())
    path.write_bytes(without_rate(whole, 0.0))
    with pytest.raises(InputError, match=r"no frame rate.*--fps"):
        load_markers(path)
    assert load_markers(path, fps=60.0).fps == 60.0
    changed = bytearray(whole)
    struct.pack_into("<f", changed, 20, 250.0)
    path.write_bytes(changed)
    found = load_markers(path)
    assert found.fps == 100.0
    assert "POINT:RATE is 100 and the header's rate 250" in found.warnings[0]


@pytest.mark.parametrize("labels", ["a b c d ", "a  c  e", "a b b d d", "a"])
def test_markers_with_a_label_of_their_own_are_read(tmp_path, labels):
    labels = labels.split(" ")
    places = np.random.default_rng(0).uniform(100, 900, (30, 5, 3))
    path = write_c3d(tmp_path / "r.c3d", places, [*labels, "x1", "x2", "x3", "x4"][:5])
    content = bytearray(path.read_bytes())
    content[content.index(b"LABELS") + 11] = len(labels)  # the second of its dimensions
    path.write_bytes(content)
    found = load_markers(path)
    own = [k for k, label in enumerate(labels) if label and labels.count(label) == 1]
    assert found.names == tuple(labels[k] for k in own)
    np.testing.assert_allclose(found.positions, places[:, own] / 1e3, rtol=1e-6)
    assert found.warnings
