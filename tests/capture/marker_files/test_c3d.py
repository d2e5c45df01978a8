"""C3D files: gaps, axes, byte orders, number formats, and files that cannot be used."""

import struct
from pathlib import Path

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
