"""Rows of an Apache Parquet table, by `pyarrow`, which the extra `parquet` installs.

A table may be far larger than memory: of the columns that are asked for one row is held at a time. What stands before
it in its group is decoded on the way.
"""

import importlib.util
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from mjx_hand.errors import InputError, reason_of
from mjx_hand.files.input_file import check_input_file

SUFFIX = ".parquet"
_LONGEST_NAME = 10**7  # bytes of any text in the table's description of itself


def is_parquet(path: Path) -> bool:
    """Whether a file is a Parquet table, by its name."""
    return path.suffix.lower() == SUFFIX and path.is_file()


def has_pyarrow() -> bool:
    """Whether Parquet can be read at all."""
    return importlib.util.find_spec("pyarrow") is not None


def columns(path: Path) -> list[str]:
    """The names of the table's columns.

    Raises:
        InputError: `pyarrow` is not installed, or the file is damaged.
    """
    return _tried(path, lambda table: list(table.schema_arrow.names))


def count_rows(path: Path) -> int:
    """How many rows there are.

    Raises:
        InputError: as `columns`.
    """
    return _tried(path, lambda table: int(table.metadata.num_rows))


def read_column(path: Path, column: str) -> list[Any]:
    """All values of a column; a dot leads into a record, as in index.uuid.

    Raises:
        InputError: as `columns`.
    """

    def values(table: Any) -> list[Any]:
        found = table.read(columns=[column], use_threads=False).to_pylist()
        for name in column.split("."):
            found = [row.get(name) if isinstance(row, dict) else None for row in found]
        return found

    return _tried(path, values)


def read_row(path: Path, row: int, wanted: Sequence[str]) -> dict[str, Any]:
    """One row, as dictionaries, lists, numbers and texts.

    Args:
        path: of the table.
        row: its number, from 0.
        wanted: the columns to read, of which those that are there are.

    Raises:
        InputError: as `columns`, or there is no such row.
    """

    def values(table: Any) -> dict[str, Any]:
        before = 0
        for group in range(table.num_row_groups):
            length = table.metadata.row_group(group).num_rows
            if before <= row < before + length:
                names = [name for name in wanted if name in table.schema_arrow.names]
                batches = table.iter_batches(batch_size=1, row_groups=[group], columns=names, use_threads=False)
                for batch in islice(batches, row - before, None):
                    return {name: batch.column(name)[0].as_py() for name in names}
            before += length
        raise InputError(f"{path}: has no row {row}; it has {before}")

    return _tried(path, values)


def _tried(path: Path, read: Any) -> Any:
    """What `read` finds in the opened table."""
    if not has_pyarrow():
        raise InputError(f"{path}: reading Parquet needs the package pyarrow: pip install 'mjx-hand[parquet]'")
    import pyarrow.parquet  # pyright: ignore[reportMissingImports]  # an extra

    check_input_file(path, "give the path of a table")
    try:
        with pyarrow.parquet.ParquetFile(path, thrift_string_size_limit=_LONGEST_NAME) as table:
            return read(table)
    except InputError:
        raise
    except Exception as error:  # what damaged bytes raise is the reader's affair
        raise InputError(f"{path}: not a readable Parquet table ({reason_of(error)}); copy it again") from None
