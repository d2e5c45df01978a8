"""How commands speak: one console for people, and lengths and angles in the units people use."""

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text


def print_table(title: str, columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """A line and a table on standard output; the first column's entries are left-aligned, numbers right."""
    print(title)  # not the table's own title, which would be broken at the table's width
    table = Table()
    for k, column in enumerate(columns):
        table.add_column(column, justify="left" if k == 0 else "right")
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))  # as text: names may hold brackets, which rich reads as markup
    Console().print(table)


def spread(values: np.ndarray, scale: float) -> tuple[str, str, str]:
    """Mean, 95th percentile and maximum, times `scale`, to two decimals."""
    figures = (values.mean(), np.percentile(values, 95), values.max())
    mean, high, most = (f"{figure * scale:.2f}" for figure in figures)
    return mean, high, most
