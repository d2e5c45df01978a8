"""Tables in text files: commas, semicolons or tabs between cells, decimal points or commas, text beside numbers."""

import csv
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.files.text_table import read_lines

_SEPARATORS = ("\t", ";", ",")
_MISSING = {"", "nan", "none", "null", "na", "n/a", "-"}
_SHOWN = 40  # characters of a cell in a message


@dataclass(frozen=True)
class Table:
    """A table of text.

    Attributes:
        path: of its file.
        said: what lines like `# unit: mm` before the header say, in lower case before the colon.
        columns: the header's cells.
        lines: the rows as they stand.
        separator: between cells.
    """

    path: Path
    said: dict[str, str]
    columns: tuple[str, ...]
    lines: tuple[str, ...]
    separator: str

    def rows(self) -> list[list[str]]:
        """The cells of every row.

        Raises:
            InputError: a row has more or fewer than the header, or a cell in quotation marks has no end.
        """
        found = []
        for k, line in enumerate(self.lines):
            cells = _cells(self.path, line, self.separator)
            while len(cells) > len(self.columns) and not cells[-1]:
                cells.pop()
            if len(cells) != len(self.columns):
                raise InputError(
                    f"{self.path}: frame {k} has {len(cells)} cells of {len(self.columns)}; truncated, or another table"
                )
            found.append(cells)
        return found

    def numbers(self, rows: Sequence[Sequence[str]], columns: Sequence[int]) -> Float[np.ndarray, "t n"]:
        """Some columns of `rows` as numbers, NaN for empty cells and what is not finite.

        Raises:
            InputError: a cell is no number.
        """
        table = np.array([[self._number(k, row[c]) for c in columns] for k, row in enumerate(rows)], float)
        table = table.reshape(len(rows), len(columns))
        table[~np.isfinite(table)] = np.nan
        return table

    def stamps(self, rows: Sequence[Sequence[str]], column: int) -> Float[np.ndarray, "t"]:
        """One column of `rows` as numbers, infinity too.

        Raises:
            InputError: a cell is no number.
        """
        return np.array([self._number(k, row[column]) for k, row in enumerate(rows)], float)

    def _number(self, row: int, cell: str) -> float:
        if cell.lower() in _MISSING:
            return np.nan
        try:
            return float(cell if self.separator == "," else cell.replace(",", "."))
        except ValueError:
            raise InputError(f"{self.path}: frame {row} has {cell[:_SHOWN]!r} where a number is expected") from None

    def repeated(self) -> list[str]:
        """Names that more than one column has."""
        return sorted(name[:_SHOWN] for name, count in Counter(self.columns).items() if count > 1)


def read_table(path: Path) -> Table:
    """A table whose first line that is neither empty nor a comment names the columns.

    Raises:
        InputError: it is no text, or a cell in quotation marks has no end.
    """
    said: dict[str, str] = {}
    lines = [line for line in read_lines(path) if line.strip()]
    for k, line in enumerate(lines):
        if not line.startswith("#"):
            counts = {each: line.count(each) for each in _SEPARATORS}
            separator = max(_SEPARATORS, key=lambda each: counts[each])
            return Table(path, said, tuple(_cells(path, line, separator)), tuple(lines[k + 1 :]), separator)
        key, _, value = line.lstrip("# ").partition(":")
        said[key.strip().lower()] = value.strip()
    return Table(path, said, (), (), ",")


def _cells(path: Path, line: str, separator: str) -> list[str]:
    try:
        cells = next(csv.reader([line], delimiter=separator)) if '"' in line else line.split(separator)
    except csv.Error as error:  # as of a mark that was never closed, with the rest of a long line behind it
        raise InputError(f"{path}: {line[:_SHOWN]!r}… is no row of a table ({error}); export it again") from None
    return [cell.strip() for cell in cells]
