"""The first block of a C3D file, checked against the file's length before anything else believes it."""

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mjx_hand.capture.marker_files.c3d_parameters import BLOCK, PROCESSORS, Numbers
from mjx_hand.errors import InputError

LONG = 0xFFFF  # the last frame that the header can name; longer recordings say theirs in a parameter
MOST = 1e5  # frames per second; a header that says more says nothing
# Points, analog values per frame, first and last frame, gap, scale, block of the data, analog samples per point frame.
_WORDS = "HHHHHfHH"


@dataclass(frozen=True)
class C3DHeader:
    """What a C3D header says.

    Attributes:
        numbers: how the file writes numbers.
        points: number of points.
        analog: number of analog values in a frame.
        frames: numbers of frames that it may mean, the likeliest first; none where it has no room for them.
        rate: frames per second; 0 where it says none.
        samples: analog samples in a frame, of each channel.
        scale: of integer coordinates; negative where coordinates are floating point.
        parameters, data: offsets in bytes of the two sections.
    """

    numbers: Numbers
    points: int
    analog: int
    frames: tuple[int, ...]
    scale: float
    rate: float
    samples: int
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
    points, analog, first, last, _, scale, start, samples = _words(content, numbers)
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
        # Frames count from 1; of those that count from 0 some files name the last, and some how many there are.
        frames=() if last == LONG else (last - first + 1, last)[: 1 if first else 2],
        scale=scale,
        rate=_rate(numbers, content),
        samples=samples,
        parameters=parameters,
        data=(start - 1) * BLOCK,
    )


def _rate(numbers: Numbers, content: bytes) -> float:
    rate = float(numbers.floats(content[20:24])[0])
    return rate if np.isfinite(rate) and 0 < rate < MOST else 0.0


def _words(content: bytes, numbers: Numbers) -> tuple:
    words = list(struct.unpack_from(numbers.order + _WORDS, content, 2))
    words[5] = float(numbers.floats(content[12:16])[0])
    return tuple(words)


def _plausible(points: int, first: int, last: int, scale: float, start: int) -> bool:
    # Scale is a factor of about a tenth of a millimetre, or negative where the data are floating point.
    return points < 10000 and 0 <= first <= last and 1e-7 < abs(scale) < 1e5 and 2 <= start < 1000
