"""The first block of a C3D file, checked against the file's length before anything else believes it."""

import struct
from dataclasses import dataclass
from pathlib import Path

from mjx_hand.capture.marker_files.c3d_parameters import BLOCK, PROCESSORS, Numbers
from mjx_hand.errors import InputError

LONG = 0xFFFF  # the last frame that the header can name; longer recordings say theirs in a parameter
# Points, analog values per frame, first and last frame, gap, scale, block of the data, analog samples per point frame.
_WORDS = "HHHHHfHH"


@dataclass(frozen=True)
class C3DHeader:
    """What a C3D header says.

    Attributes:
        numbers: how the file writes numbers.
        points: number of points.
        analog: number of analog values in a frame.
        frames: number of frames; None where the header has no room for it.
        scale: of integer coordinates; negative where coordinates are floating point.
        parameters, data: offsets in bytes of the two sections.
    """

    numbers: Numbers
    points: int
    analog: int
    frames: int | None
    scale: float
    parameters: int
    data: int

    @property
    def frame_bytes(self) -> int:
        return (4 * self.points + self.analog) * (4 if self.scale < 0 else 2)


def read_header(path: Path, content: bytes) -> C3DHeader:
    """The header of a C3D file.

    Raises:
        InputError: the file is not C3D, is cut off, or not of the byte order that it says.
    """
    if len(content) < 2 * BLOCK or content[1] != 0x50:
        raise InputError(f"{path}: not a C3D file, or cut off in its header; export it again")
    parameters = (content[0] - 1) * BLOCK
    processor = content[parameters + 3] if 0 <= parameters < len(content) - 3 else 0
    if processor not in PROCESSORS:
        raise InputError(
            f"{path}: processor type {processor} in the C3D file, valid are 84, 85, 86; it is damaged, export it again"
        )
    numbers = PROCESSORS[processor]
    points, analog, first, last, _, scale, start, _ = _words(content, numbers)
    if not _plausible(points, first, last, scale, start):
        other = PROCESSORS[84 if numbers.order == ">" else 86]
        swapped = _words(content, other)
        reason = "the C3D header makes no sense"
        if _plausible(swapped[0], *swapped[2:4], *swapped[5:7]):
            names = {"<": "little-endian", ">": "big-endian"}
            reason = f"the C3D header says {names[numbers.order]}, but its numbers are {names[other.order]}"
        raise InputError(f"{path}: {reason} ({points} points, frames {first} to {last}); export it again")
    return C3DHeader(
        numbers=numbers,
        points=points,
        analog=analog,
        frames=None if last == LONG else last - first + 1,
        scale=scale,
        parameters=parameters,
        data=(start - 1) * BLOCK,
    )


def _words(content: bytes, numbers: Numbers) -> tuple:
    words = list(struct.unpack_from(numbers.order + _WORDS, content, 2))
    words[5] = float(numbers.floats(content[12:16])[0])
    return tuple(words)


def _plausible(points: int, first: int, last: int, scale: float, start: int) -> bool:
    # Scale is a factor of about a tenth of a millimetre, or negative where the data are floating point.
    return points < 10000 and 1 <= first <= last and 1e-7 < abs(scale) < 1e5 and 2 <= start < 1000
