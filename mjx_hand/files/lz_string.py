"""LZString's compression of text to base64 (https://github.com/pieroxy/lz-string), which recorders for browsers use.

A stream of codes, each as many bits as the dictionary needs, lowest bit first: 0 and 1 bring a new character of 8 or 16
bits, 2 ends the text, all others name an entry. Every entry is the one before and a character, as in LZ78.
"""

import base64
import binascii

import numpy as np

LONGEST = 2**28  # characters: a short text can stand for one that no memory holds
_CHARACTER, _WIDE_CHARACTER, _END = 0, 1, 2


class _Bits:
    """Numbers of any width from bytes, whose bits are taken from the highest on."""

    def __init__(self, data: bytes) -> None:
        self._bits = (np.unpackbits(np.frombuffer(data, np.uint8)) + ord("0")).tobytes()
        self._at = 0

    def number(self, width: int) -> int:
        taken = self._bits[self._at : self._at + width]
        if len(taken) < width:
            raise ValueError("it ends too early")
        self._at += width
        return int(taken[::-1], 2)


def decompress_base64(text: str, longest: int = LONGEST) -> str:
    """The text of what LZString's `compressToBase64` made.

    Args:
        text: base64, line breaks allowed.
        longest: how many characters there may be.

    Raises:
        ValueError: it is not LZString's, is cut short, or is longer.
    """
    packed = "".join(text.split()).rstrip("=")
    try:
        data = base64.b64decode(packed + "=" * (-len(packed) % 4), validate=True)
    except binascii.Error as error:
        raise ValueError(f"it is no base64: {error}") from None
    bits = _Bits(data)
    entries = ["", "", ""]  # the places of the three codes that name no entry
    width, previous, parts, length = 2, "", [], 0
    while True:
        code = bits.number(width)
        if code == _END:
            return "".join(parts)
        if code in (_CHARACTER, _WIDE_CHARACTER):
            entries.append(chr(bits.number(8 if code == _CHARACTER else 16)))
            code = len(entries) - 1
            # The new character is an entry of its own, and so is what came before with it: both widen the codes.
        if code < len(entries):
            entry = entries[code]
        elif code == len(entries) and previous:
            entry = previous + previous[0]
        else:
            raise ValueError("it names an entry that is not there")
        parts.append(entry)
        length += len(entry)
        if length > longest:
            raise ValueError(f"it stands for more than {longest} characters")
        if previous:
            entries.append(previous + entry[0])
        previous = entry
        width = max(width, len(entries).bit_length())
