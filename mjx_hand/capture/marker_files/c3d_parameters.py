"""The parameter section of a C3D file: groups of named values (https://www.c3d.org/HTML/default.htm).

Read here and not by a library: the one that there is ends the process on some damaged files, and returns what is left
of a truncated one without a word.
"""

from dataclasses import dataclass

import numpy as np

BLOCK = 512
_SIZES = {-1: 1, 1: 1, 2: 2, 4: 4}  # bytes of a value by type: character, byte, integer, floating point


@dataclass(frozen=True)
class Numbers:
    """How a file writes numbers.

    Attributes:
        order: byte order of integers, "<" or ">".
        vax: floating point is that of DEC's VAX.
    """

    order: str
    vax: bool = False

    def integers(self, content: bytes) -> np.ndarray:
        """16-bit numbers with sign."""
        return np.frombuffer(content, f"{self.order}i2")

    def floats(self, content: bytes) -> np.ndarray:
        """Single-precision numbers."""
        if not self.vax:
            return np.frombuffer(content, f"{self.order}f4").astype(np.float32)
        # The VAX has its two words the other way round, and an exponent greater by two.
        words = np.frombuffer(content, "<u2").reshape(-1, 2)[:, ::-1]
        return words.copy().view("<f4")[:, 0] / 4


PROCESSORS = {84: Numbers("<"), 85: Numbers("<", vax=True), 86: Numbers(">")}  # Intel, DEC, SGI/MIPS


Parameters = dict[str, dict[str, list]]


def read_parameters(section: bytes, numbers: Numbers) -> Parameters:
    """Values by group and name, in upper case: strings, or numbers in the order of the file.

    Args:
        section: the file from the first of its parameter blocks on.
        numbers: how it writes them.

    Raises:
        ValueError: the section is damaged.
    """
    names: dict[int, str] = {}
    values: dict[int, dict[str, list]] = {}
    at = 4
    while at + 2 <= len(section):
        length, number = (int(v) for v in np.frombuffer(section[at : at + 2], np.int8))
        if length == 0:
            break
        name = section[at + 2 : at + 2 + abs(length)].decode("latin-1").strip().upper()
        link = at + 2 + abs(length)
        if number == 0 or link + 2 > len(section):
            raise ValueError("a parameter without a group, or beyond the end")
        if number < 0:
            names[-number] = name
        else:
            values.setdefault(number, {})[name] = _value(section[link + 2 :], numbers)
        step = int(numbers.integers(section[link : link + 2])[0])
        if step <= 0:
            break
        at = link + step
    return {name: values.get(number, {}) for number, name in names.items()}


def _value(content: bytes, numbers: Numbers) -> list:
    kind = int(np.frombuffer(content[:1], np.int8)[0]) if content else 0
    if kind not in _SIZES or len(content) < 2:
        raise ValueError("a parameter of unknown type")
    dimensions = list(content[2 : 2 + content[1]])
    count = int(np.prod(dimensions, dtype=np.int64)) if dimensions else 1
    start = 2 + len(dimensions)
    data = content[start : start + count * _SIZES[kind]]
    if len(data) < count * _SIZES[kind]:
        raise ValueError("a parameter beyond the end")
    if kind == -1:  # strings of the first dimension's length
        width = max(dimensions[0] if dimensions else 1, 1)
        return [_string(data[k : k + width]) for k in range(0, len(data), width)]
    if kind == 1:
        return list(data)
    return (numbers.integers(data) if kind == 2 else numbers.floats(data)).tolist()


def _string(content: bytes) -> str:
    try:
        return content.decode("utf-8").strip(" \0")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace").strip(" \0")
