"""The row of a Parquet table that holds one recording."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mjx_hand.errors import InputError
from mjx_hand.files.parquet_table import columns, count_rows, read_column, read_row

_DIGITS = 18  # of a row's number


def chosen_row(path: Path, sequence: str | None, wanted: Sequence[str]) -> tuple[str, dict[str, Any]]:
    """What the recording is called, and its row.

    Args:
        path: of a table with a recording a row.
        sequence: the row's number, from 0, or the `uuid` in its column `index`; None where the table has one row.
        wanted: the columns to read, of which those that are there are.

    Raises:
        InputError: there are several and none was asked for, or no such one, or the table cannot be read.
    """
    count = count_rows(path)
    if sequence is None and count == 1:
        return path.stem, read_row(path, 0, wanted)
    row = int(sequence) if sequence is not None and sequence.isdecimal() and len(sequence) <= _DIGITS else None
    if row is None and sequence is not None and "index" in columns(path):
        row = next((k for k, uuid in enumerate(read_column(path, "index.uuid")) if uuid == sequence), None)
    if row is None or row >= count:
        what = f"{count} recordings" if sequence is None else f"no recording {sequence!r}"
        raise InputError(f"{path}: holds {what}; choose one with sequence=: its row, 0 to {count - 1}, or its uuid")
    return f"{path.stem} {sequence}", read_row(path, row, wanted)
