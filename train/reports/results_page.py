"""The results of all experiments as one page, as Markdown and as JSON, made of what their evaluations left on disk."""

import dataclasses
import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from envs.evaluation.failure import FAILURES
from mjx_hand.files.npz_archive import replacing
from mjx_hand.view.figures.learning_figure import learning_curves
from mjx_hand.view.report import Film, Headline, Plot, Report, Section, Table, write_report
from train.experiment.evaluate_seeds import PART_WORDS, POLICY
from train.learning.curve import LEARNED
from train.reports.machine import machine
from train.reports.published import PAPER
from train.reports.results_table import Experiment, failures_table, minutes_of, results_table
from train.reports.stress_summary import stress_summary

SCHEMA = "mjx-hand/results/1"
PACKAGES = ("mjx-hand", "mujoco", "mujoco-mjx", "jax", "brax")
_TASK = (
    "Policies that replay human demonstrations in physics: reach, grasp, lift, carry, turn and hold, on demonstrations "
    "by people and with objects that training has not seen."
)
_LEARNING = (
    "Share of the training demonstrations followed from frame 0, unassisted. The first point is the untrained policy."
)


def write_results_page(experiments: Sequence[Experiment], waiting: Sequence[str], folder: Path, command: str) -> None:
    """Write `index.html`, `results.md` and `results.json`.

    Args:
        experiments: that are done, at least one.
        waiting: names of those that are not.
        folder: to write to.
        command: that makes the page again.

    Raises:
        InputError: the folder cannot be written.
    """
    page, text, figures = (folder / name for name in ("index.html", "results.md", "results.json"))
    write_report(page, _page(experiments, waiting, command))
    with replacing(text) as temporary:
        temporary.write_text(_markdown(experiments, waiting, folder, command), encoding="utf-8")
    with replacing(figures) as temporary:
        temporary.write_text(json.dumps(_json(experiments), indent=1) + "\n")


def _page(experiments: Sequence[Experiment], waiting: Sequence[str], command: str) -> Report:
    table, failures, disturbed = _tables(experiments)
    last = dict(zip(table.columns, table.rows[-1], strict=True))
    hardware, packages = machine(*PACKAGES)
    return Report(
        title="mjx-hand: results",
        task=_TASK + (f" Not done yet: {', '.join(waiting)}." if waiting else ""),
        headlines=(
            Headline("never lost (CHORD)", last["CHORD"]),
            *([Headline("held 5 s longer", last["held 5 s"])] if last["held 5 s"] else []),
            Headline("tracking error", last["tracking error"], _beside(last["paper's tracking error"])),
            Headline(
                "nothing learned: never lost and held",
                last["constant press"],
                f"constant press; policies {last['followed']}, zero residual {last['zero residual']}, "
                f"demonstration alone {last['demonstration alone']}",
            ),
        ),
        sections=(
            Section("Every experiment", [table]),
            *([Section("Under disturbances", [disturbed])] if disturbed else []),
            Section("Learning", [_curves(experiment) for experiment in experiments]),
            Section("Demonstration and twin", [film for experiment in experiments for film in _films(experiment)]),
            Section("How failures failed", [_shares(experiments)]),
            *([Section("Failures", [failures])] if failures.rows else []),
        ),
        how=[(experiment.name, _made_with(experiment)) for experiment in experiments]
        + [("this machine", hardware), ("versions", packages)],
        commands=[command],
    )


def _tables(experiments: Sequence[Experiment]) -> tuple[Table, Table, Table | None]:
    """Scores, failures, and what disturbances do."""
    return results_table(experiments), failures_table(experiments), stress_summary(experiments)


def _curves(experiment: Experiment) -> Plot:
    lines = {
        f"seed {seed}": np.array([(point.steps, point.success) for point in points])
        for seed, points in experiment.curves.items()
    }
    learned, total = minutes_of(experiment.curves)
    caption = _LEARNING + f" {len(learned)} of {len(total)} seeds reached {100 * LEARNED:.0f} %"
    caption += f", after {min(learned):.1f} to {max(learned):.1f} minutes." if learned else "."
    return Plot(learning_curves(lines, experiment.name, LEARNED), caption)


def _films(experiment: Experiment) -> list[Film]:
    made = []
    for note in experiment.summary["films"].values():
        path = experiment.folder / note["file"] if note["file"] else None
        caption = f"{experiment.name}. {note['caption']}"
        if path is not None and not path.is_file():
            made.append(
                Film(None, caption, f"{path} is gone; delete {experiment.folder / 'evaluation.json'} for a new one")
            )
        else:
            made.append(Film(path, caption, note["missing"]))
    return made


def _shares(experiments: Sequence[Experiment]) -> Table:
    rows = [
        (reason, *(f"{100 * experiment.summary['failures'][POLICY][reason]:.1f} %" for experiment in experiments))
        for reason in FAILURES
    ]
    return Table(
        ("", *(experiment.name for experiment in experiments)), rows, "Shares of all rollouts of the policies."
    )


def _made_with(experiment: Experiment) -> str:
    summary = experiment.summary
    people = f" by {len(summary['people'])} people" if summary["people"] else ""
    steps = max(points[-1].steps for points in experiment.curves.values())
    return (
        f"seeds {', '.join(summary['seeds'])}; {steps:,} control steps; engine {summary['engine']}; "
        f"{summary['demonstrations']} {PART_WORDS[summary['part']]}{people}"
    )


def _beside(paper: str) -> str:
    return f"paper {paper}" if paper else ""


def _markdown(experiments: Sequence[Experiment], waiting: Sequence[str], folder: Path, command: str) -> str:
    table, failures, disturbed = _tables(experiments)
    lines = ["# Results", "", _TASK, "", *markdown_rows(table), "", table.note, ""]
    if disturbed:
        lines += ["## Under disturbances", "", *markdown_rows(disturbed), "", disturbed.note, ""]
    if waiting:
        lines += [f"Not done yet: {', '.join(waiting)}.", ""]
    lines += ["## How failures failed", "", *markdown_rows(_shares(experiments)), ""]
    if failures.rows:
        lines += ["## Failures", "", *markdown_rows(failures), ""]
    lines += ["## More", ""]
    for experiment in experiments:
        where = Path(os.path.relpath(experiment.folder, folder)).as_posix()
        links = [f"[every demonstration]({where}/evaluation.html)"]
        links += [
            f"[{name}]({where}/{note['file']})" for name, note in experiment.summary["films"].items() if note["file"]
        ]
        lines.append(f"- {experiment.name}: {', '.join(links)}; {_made_with(experiment)}")
    lines += ["", *(f"- {line}" for line in machine(*PACKAGES)), "", f"    {command}"]
    return "\n".join(lines) + "\n"


def markdown_rows(table: Table) -> list[str]:
    """A table as lines of Markdown."""

    def line(cells: Sequence[str]) -> str:
        return f"| {' | '.join(cell or '–' for cell in cells)} |"

    first, *others = table.columns
    heading = f"| {' | '.join([first, *others])} |"
    return [heading, "|" + "|".join(["---", *["---:"] * len(others)]) + "|", *(line(row) for row in table.rows)]


def _json(experiments: Sequence[Experiment]) -> dict[str, object]:
    table = results_table(experiments)
    content = {}
    for experiment in experiments:
        learned, total = minutes_of(experiment.curves)
        content[experiment.name] = {
            **experiment.summary,
            "paper": dataclasses.asdict(experiment.paper) if experiment.paper else None,
            "curves": {seed: [dataclasses.asdict(p) for p in points] for seed, points in experiment.curves.items()},
            "minutes_to_learn": learned,
            "minutes_of_training": total,
            "stress": experiment.stress,
        }
    return {
        "schema": SCHEMA,
        "machine": machine(*PACKAGES),
        "paper": {name: dataclasses.asdict(row) for name, row in PAPER.items()},
        "table": {"columns": list(table.columns), "rows": [list(row) for row in table.rows]},
        "experiments": content,
    }
