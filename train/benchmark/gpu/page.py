"""The staged benchmark's report: a page in Markdown, the figures as JSON, plots, and errors with all their lines."""

import dataclasses
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mjx_hand.files.npz_archive import replacing
from mjx_hand.view.figures import plots
from train.benchmark.gpu.record import DONE, Cell, Record, Table
from train.benchmark.report_files import write_report
from train.reports.machine import machine

NAME, SCHEMA = "gpu", "mjx-hand/benchmark-gpu/1"
_WHERE_INSTALLED = {"warp-lang": "warp", "dexi-rs": "dexi_rs"}
PACKAGES = (
    *("mjx-hand", "mujoco", "mujoco-mjx", "jax", "jaxlib", "brax", "flax", "numpy"),
    *(name for name, module in _WHERE_INSTALLED.items() if find_spec(module)),
)


@dataclasses.dataclass
class Pages:
    """Writes records to a folder; a plot is drawn once.

    Attributes:
        folder: for `gpu.md`, `gpu.json`, `FIGURE.png` and `STAGE-error.txt`.
        options: that the benchmark was given.
    """

    folder: Path
    options: Mapping[str, Any]
    _drawn: set[str] = dataclasses.field(default_factory=set)

    def __call__(self, records: Sequence[Record], trace: tuple[str, str] | None = None) -> None:
        """Write all that is known; `trace` is a stage's name and its error.

        Raises:
            InputError: the folder cannot be written.
        """
        content = {"options": self.options, "stages": [record.content() for record in records]}
        write_report(self.folder, NAME, text(records), SCHEMA, PACKAGES, content)
        for name, figure in ((n, f) for record in records for n, f in record.figures.items()):
            if name not in self._drawn:
                plots.save_figure(figure, self.folder / f"{name}.png")
                self._drawn.add(name)
        if trace is not None:
            with replacing(self.folder / f"{trace[0]}-error.txt") as temporary:
                temporary.write_text(trace[1])


def text(records: Sequence[Record]) -> list[str]:
    """The page's lines."""
    lines = ["## On a GPU", "", *machine(*PACKAGES), "", *markdown(_summary(records))]
    for record in records:
        if not (record.notes or record.tables):
            continue
        lines += ["", f"### {record.title}"]
        if record.status != DONE:
            lines += ["", f"*{record.status}{': ' + record.reason if record.reason else ''}*"]
        lines += ["", *(f"- {note}" for note in record.notes)] if record.notes else []
        lines += [f"- Left out for want of time: {', '.join(record.left_out)}."] if record.left_out else []
        for table in record.tables:
            lines += ["", *markdown(table)] if table.rows else []
        lines += ["", *(f"![{name}]({name}.png)" for name in record.figures)] if record.figures else []
    return lines


def _summary(records: Sequence[Record]) -> Table:
    table = Table(("stage", "what", "seconds", "how it ended"))
    for record in records:
        end = f"{record.status}: {record.reason}" if record.reason else record.status
        table.add(record.name, record.title, round(record.seconds) or None, end)
    return table


def markdown(table: Table) -> list[str]:
    """A table's lines; numbers stand to the right."""
    numbers = [
        all(not isinstance(cell, str) for cell in column) and any(cell is not None for cell in column)
        for column in zip(*table.rows, strict=True)
    ] or [False] * len(table.columns)
    return [
        f"| {' | '.join(table.columns)} |",
        f"|{'|'.join('---:' if number else '---' for number in numbers)}|",
        *(f"| {' | '.join(shown(cell) for cell in row)} |" for row in table.rows),
    ]


def shown(cell: Cell) -> str:
    """A cell as it is printed: whole numbers in full from a thousand on, others to three digits."""
    if cell is None:
        return "–"
    if isinstance(cell, str):
        return cell.replace("|", "/")
    if isinstance(cell, int) or abs(cell) >= 1000:
        return f"{cell:,.0f}"
    return f"{cell:.3g}"
