"""`write_report`: everything about a training run on one HTML page that needs nothing but itself."""

import base64
import dataclasses
from collections.abc import Sequence
from pathlib import Path

import jinja2
from matplotlib.figure import Figure

from mjx_hand.errors import InputError
from mjx_hand.motion.archive import replacing
from mjx_hand.view.plots import inline_svg


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
class Report:
    """What a report says; sections that are None are left out.

    Attributes:
        title: of the page.
        task: what the twin is to do, in a sentence.
        headlines: the few numbers that matter most.
        video: an MP4 file, or None.
        video_missing: why there is no video; required where there is none.
        video_caption: what the video shows.
        learning_curve, tracking, projection, retargeting: figures of `plots`.
        success: metrics, a row each, for policy, baseline and what was published.
        failures: how failed rollouts failed.
        how: (what, value) rows of how it was made: versions, hardware, seeds, timings.
        commands: commands that make it again.
    """

    title: str
    task: str
    headlines: Sequence[Headline] = ()
    video: Path | None = None
    video_missing: str = ""
    video_caption: str = ""
    learning_curve: Plot | None = None
    tracking: Plot | None = None
    success: Table | None = None
    failures: Table | None = None
    projection: Plot | None = None
    retargeting: Plot | None = None
    how: Sequence[tuple[str, str]] = ()
    commands: Sequence[str] = ()


def write_report(path: str | Path, report: Report) -> None:
    """Write one HTML file that loads nothing from anywhere; it appears whole or not at all.

    Raises:
        InputError: neither a video nor a reason, a video file that is not there, or a table of uneven rows.
    """
    if report.video is None and not report.video_missing:
        raise InputError("the report has no video and no reason for it; give `video` or say why in `video_missing`")
    if report.video is not None and not report.video.is_file():
        raise InputError(f"{report.video}: no such video; render it first, or say why not in `video_missing`")
    for table in filter(None, (report.success, report.failures)):
        for row in table.rows:
            if len(row) != len(table.columns):
                raise InputError(f"table row {row[0]!r} has {len(row)} cells for {len(table.columns)} columns")
    with replacing(path) as temporary:
        temporary.write_text(_html(report), encoding="utf-8")


def _html(report: Report) -> str:
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    template = environment.from_string(Path(__file__).with_name("report.html.j2").read_text(encoding="utf-8"))
    plots = {
        name: inline_svg(plot.figure, name)
        for name in ("learning_curve", "tracking", "projection", "retargeting")
        if (plot := getattr(report, name)) is not None
    }
    video = None if report.video is None else base64.b64encode(report.video.read_bytes()).decode("ascii")
    return template.render(report=report, plots=plots, video=video)
