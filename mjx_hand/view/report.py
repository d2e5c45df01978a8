"""`write_report`: tables, figures and videos of trainings on one HTML page that needs nothing but itself."""

import base64
import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path

import jinja2
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table as RichTable

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import replacing
from mjx_hand.view.figures.plots import inline_svg


@dataclasses.dataclass(frozen=True)
class Headline:
    """One large number: what it is, its value as text, and what to compare it with."""

    label: str
    value: str
    note: str = ""


@dataclasses.dataclass(frozen=True)
class Table:
    """Rows of text under named columns; the first column names the row. "" is a cell with nothing to show."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


@dataclasses.dataclass(frozen=True)
class Plot:
    """A figure and the sentence below it."""

    figure: Figure
    caption: str = ""


@dataclasses.dataclass(frozen=True)
class Film:
    """A video and the sentence below it.

    Attributes:
        path: of an MP4 file, or None.
        caption: what it shows.
        missing: why there is no video; required where there is none.
    """

    path: Path | None
    caption: str = ""
    missing: str = ""


@dataclasses.dataclass(frozen=True)
class Section:
    """Part of a page: what stands under one heading, from top to bottom; several figures stand in columns."""

    title: str
    parts: Sequence[Table | Plot | Film]


@dataclasses.dataclass(frozen=True)
class Report:
    """What a report says.

    Attributes:
        title: of the page.
        task: what the twin is to do, in a sentence.
        headlines: the few numbers that matter most.
        sections: tables, figures and videos.
        how: (what, value) rows of how it was made: versions, hardware, seeds, timings.
        commands: commands that make it again.
    """

    title: str
    task: str
    headlines: Sequence[Headline] = ()
    sections: Sequence[Section] = ()
    how: Sequence[tuple[str, str]] = ()
    commands: Sequence[str] = ()


def print_table(table: Table) -> None:
    """A report's table on the terminal."""
    made = RichTable(*table.columns, caption=table.note or None)
    for row in table.rows:
        made.add_row(*row)
    Console().print(made)


def write_report(path: str | Path, report: Report) -> None:
    """Write one HTML file that loads nothing from anywhere; it appears whole or not at all.

    Raises:
        InputError: neither a video nor a reason, a video file that is not there, or a table of uneven rows.
    """
    for part in (part for section in report.sections for part in section.parts):
        _check(part)
    with replacing(path) as temporary:
        temporary.write_text(_html(report), encoding="utf-8")


def _check(part: Table | Plot | Film) -> None:
    if isinstance(part, Film):
        if part.path is None and not part.missing:
            raise InputError("the report has no video and no reason for it; give its `path` or say why in `missing`")
        if part.path is not None and not part.path.is_file():
            raise InputError(f"{part.path}: no such video; render it first, or say why not in `missing`")
    if isinstance(part, Table):
        for row in part.rows:
            if len(row) != len(part.columns):
                raise InputError(f"table row {row[0]!r} has {len(row)} cells for {len(part.columns)} columns")


def _html(report: Report) -> str:
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    template = environment.from_string(Path(__file__).with_name("report.html.j2").read_text(encoding="utf-8"))
    names = itertools.count(1)
    sections = [(section.title, [_shown(part, names) for part in section.parts]) for section in report.sections]
    return template.render(report=report, sections=sections)


def _shown(part: Table | Plot | Film, names: Iterator[int]) -> dict[str, object]:
    """A part as the template takes it: its kind, its text, and its picture as the page holds it."""
    if isinstance(part, Table):
        return {"kind": "table", "table": part, "note": part.note}
    if isinstance(part, Plot):
        return {"kind": "plot", "svg": inline_svg(part.figure, f"plot{next(names)}"), "note": part.caption}
    video = None if part.path is None else base64.b64encode(part.path.read_bytes()).decode("ascii")
    return {"kind": "film", "video": video, "missing": part.missing, "note": part.caption}
