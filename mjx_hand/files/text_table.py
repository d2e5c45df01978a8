"""Numbers in text files: lines to an array, with the line named where a number cannot be read."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.files.input_file import refuse_pointer

_MISSING = {"", "nan", "NaN", "NAN", "null", "NULL", "-", "-nan", "-nan(ind)"}


def read_lines(path: Path) -> list[str]:
    """The lines of a text file, in UTF-8 or else Windows' western code page, which capture software writes.

    Raises:
        InputError: the file is binary, or cannot be read.
    """
    refuse_pointer(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    if b"\0" in content:
        raise InputError(f"{path}: not a text file; name it by its format's suffix, as in recording.c3d")
    try:
        return content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace").splitlines()


def numbers_of(
    path: Path,
    lines: Sequence[str],
    separator: str,
    columns: int,
    first: int,
    *,
    trimmed: bool = False,
    wider: bool = False,
) -> Float[np.ndarray, "t n"]:
    """One row per line, empty cells and the word nan as NaN.

    Args:
        path: for messages.
        lines: the table; blank lines are passed over.
        separator: between cells.
        columns: how many every row has. One empty cell more, from a separator at the line's end, is allowed.
        first: number of the first line in the file, from 1.
        trimmed: rows may lack empty cells at their end.
        wider: rows may have more cells, which are passed over.

    Raises:
        InputError: a row of another length, or a cell that is not a number.
    """
    rows = []
    for number, line in enumerate(lines, start=first):
        if not line.strip():
            continue
        cells = [cell.strip() for cell in line.split(separator)]
        while len(cells) > columns and (wider or not cells[-1]):
            cells.pop()
        if trimmed:
            cells += [""] * (columns - len(cells))
        if len(cells) != columns:
            raise InputError(
                f"{path}: line {number} has {len(cells)} columns, expected {columns}; truncated, or of another table"
            )
        try:
            rows.append([np.nan if cell in _MISSING else float(cell) for cell in cells])
        except ValueError as error:
            raise InputError(f"{path}: line {number}: {str(error).split(': ')[-1]} is not a number") from None
    return np.array(rows).reshape(-1, columns)


def positive(path: Path, name: str, value: str) -> float:
    """A number above 0 from a header.

    Raises:
        InputError: it is not one.
    """
    try:
        number = float(value)
    except ValueError:
        number = np.nan
    if not (np.isfinite(number) and number > 0):
        raise InputError(f"{path}: {name} is {value!r} in the header, expected a number above 0")
    return number


def check_count(path: Path, promised: float, found: int) -> None:
    """Refuse a table that is shorter than its header promises.

    Raises:
        InputError: it is.
    """
    if found < promised:
        raise InputError(f"{path}: {found} of {promised:g} frames are there; the file is truncated, export it again")
