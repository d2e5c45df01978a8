"""What became of each stage of a benchmark: how it ended, and its tables, notes and figures."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

NOT_REACHED, UNDER_WAY, DONE = "not reached", "under way", "done"
SHORTENED, SKIPPED, FAILED, INTERRUPTED = "cut short", "skipped", "failed", "interrupted"

Cell = str | int | float | None


@dataclasses.dataclass(frozen=True)
class Table:
    """Rows of figures under named columns; None where something was not measured.

    Attributes:
        columns: what each column holds, with its unit.
        rows: a cell a column.
    """

    columns: Sequence[str]
    rows: list[Sequence[Cell]] = dataclasses.field(default_factory=list)

    def add(self, *cells: Cell) -> None:
        """Append a row."""
        if len(cells) != len(self.columns):
            raise ValueError(f"{len(cells)} cells for {len(self.columns)} columns")
        self.rows.append(cells)


@dataclasses.dataclass
class Record:
    """One stage's results; it grows while the stage runs.

    Attributes:
        name, title: of the stage.
        status: one of those above.
        reason: why it was skipped or failed, one line.
        seconds: that it took.
        notes: sentences that stand above the tables.
        left_out: points that time did not suffice for.
        tables: its figures.
        figures: plots by the name of their file, without its suffix.
    """

    name: str
    title: str
    status: str = NOT_REACHED
    reason: str = ""
    seconds: float = 0.0
    notes: list[str] = dataclasses.field(default_factory=list)
    left_out: list[str] = dataclasses.field(default_factory=list)
    tables: list[Table] = dataclasses.field(default_factory=list)
    figures: dict[str, Figure] = dataclasses.field(default_factory=dict)

    def table(self, *columns: str) -> Table:
        """A new table at the end."""
        self.tables.append(Table(columns))
        return self.tables[-1]

    def content(self) -> dict[str, Any]:
        """All but the plots, as JSON can say it."""
        kept = {field.name: getattr(self, field.name) for field in dataclasses.fields(self) if field.name != "figures"}
        return {**kept, "tables": [dataclasses.asdict(table) for table in self.tables]}
