"""How commands speak: one console for people, and lengths and angles in the units people use."""

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from mjx_hand.errors import InputError


def print_table(title: str, columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """A line and a table on standard output; the first column's entries are left-aligned, numbers right."""
    print(title)  # not the table's own title, which would be broken at the table's width
    table = Table()
    for k, column in enumerate(columns):
        table.add_column(column, justify="left" if k == 0 else "right")
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))  # as text: names may hold brackets, which rich reads as markup
    Console().print(table)


def print_warnings(warnings: tuple[str, ...]) -> None:
    """What is doubtful about a result, a line each; it stands in the file too."""
    for warning in warnings:
        print(f"warning: {warning}")


def spread(values: np.ndarray, scale: float) -> tuple[str, str, str]:
    """Mean, 95th percentile and maximum, times `scale`, to two decimals."""
    figures = (values.mean(), np.percentile(values, 95), values.max())
    mean, high, most = (f"{figure * scale:.2f}" for figure in figures)
    return mean, high, most


def check_out(out: Path, *inputs: Path | None) -> None:
    """Look at the path of an .npz that is to be written, before any work is done.

    Raises:
        InputError: it is not named so, is a folder, or is one of the inputs, which it would overwrite.
    """
    if out.is_dir():
        raise InputError(f"{out}: is a folder; --out is the .npz file to write")
    if out.suffix.lower() != ".npz":
        raise InputError(f"{out}: --out is an .npz file; name it {out.with_suffix('.npz')}")
    for path in inputs:
        if path is not None and out.exists() and path.exists() and out.samefile(path):
            raise InputError(f"{out}: is what is read; give another --out, so that the recording is kept")
