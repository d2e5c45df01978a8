"""What a C3D file's first 512 bytes promise, checked against its length before anything else believes it.

The reading library returns the frames that are there of a truncated file, without a word. Layout:
https://www.c3d.org/HTML/default.htm (header section, parameter section).
"""

import struct
from pathlib import Path

from mjx_hand.errors import InputError

BLOCK = 512
_PROCESSORS = {84: "<", 85: "", 86: ">"}  # Intel, DEC (its floating point is neither), SGI/MIPS
_WORDS = "HHHHHfHH"  # points, analog values a frame, first, last frame, gap, scale, data start, analog a point frame


def check_c3d(path: Path) -> None:
    """Refuse a file that is not C3D, is cut off, or is not of the byte order that it says.

    Raises:
        InputError: it is.
    """
    content = path.read_bytes()
    if len(content) < 2 * BLOCK or content[1] != 0x50:
        raise InputError(f"{path}: not a C3D file, or cut off in its header; export it again")
    at = (content[0] - 1) * BLOCK + 3
    processor = content[at] if 0 <= at < len(content) else 0
    order = _PROCESSORS.get(processor)
    if order is None:
        raise InputError(f"{path}: processor type {processor} in the C3D header, expected 84; the file is damaged")
    if order != "<":
        raise InputError(f"{path}: C3D numbers of a {'MIPS' if order else 'DEC'} processor; save it as Intel C3D")
    points, analog, first, last, _, scale, start, _ = struct.unpack_from("<" + _WORDS, content, 2)
    if not _plausible(points, first, last, scale, start):
        swapped = struct.unpack_from(">" + _WORDS, content, 2)
        big = _plausible(swapped[0], *swapped[2:4], *swapped[5:7])
        reason = "its numbers are big-endian, its header says Intel" if big else "its header makes no sense"
        raise InputError(f"{path}: {reason} ({points} points, frames {first} to {last}); save it as Intel C3D")
    if last == 0xFFFF:  # longer recordings say their length elsewhere
        return
    wanted = (start - 1) * BLOCK + (last - first + 1) * (4 * points + analog) * (4 if scale < 0 else 2)
    if len(content) < wanted:
        raise InputError(f"{path}: {len(content)} of {wanted} bytes are there; the file is truncated, export it again")


def _plausible(points: int, first: int, last: int, scale: float, start: int) -> bool:
    # Scale is a factor about a tenth of a millimetre, or negative where the data are floating point.
    return 0 <= points < 10000 and 1 <= first <= last and 1e-7 < abs(scale) < 1e5 and 2 <= start < 1000
