"""Ablations as one page, as Markdown and as JSON: a row a variant, and its learning curve beside the unchanged one."""

import dataclasses
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.files.npz_archive import replacing
from mjx_hand.view.figures.learning_figure import learning_curves
from mjx_hand.view.report import Headline, Plot, Report, Section, Table, write_report
from train.experiment.evaluate_seeds import POLICY, ZERO
from train.learning.curve import LEARNED
from train.reports.ablations_variants import UNCHANGED, Variant
from train.reports.machine import machine
from train.reports.results_page import PACKAGES, markdown_rows
from train.reports.results_table import Experiment
from train.reports.score_table import score_number, score_text

SCHEMA = "mjx-hand/ablations/1"
_SUCCESS, _TRACKING = "manip_trans_object", "tracking_error_cm"
_SHOWN = {
    _SUCCESS: "success",
    _TRACKING: "tracking error",
    "object_rotation_error_deg": "rotation error",
    "hold": "held 5 s",
    "chord": "CHORD",
}
_TASK = (
    "What each part of the method is worth: policies trained without it, or with another in its place, all with the "
    "same budget and seeds, on demonstrations that training has not seen."
)
_NOTE = (
    "Mean over seeds (least to greatest seed), of every rollout of every held-out demonstration, from frame 0, "
    "unassisted. Success: ManipTrans' for the object, mean errors below 3 cm and 30°. Zero residual: success of the "
    "variant's own reference without learning. Another projection is of the same recordings."
)
_LEARNING = "Share of the training demonstrations followed from frame 0, unassisted; mean over seeds."


@dataclasses.dataclass(frozen=True)
class Ablation:
    """One experiment's variants that are done.

    Attributes:
        name: of the experiment.
        steps: control steps of each training.
        measured: the variants, in order, each with its trainings and evaluation; baselines with `UNCHANGED`'s.
        waiting: names of those that are not done.
    """

    name: str
    steps: int
    measured: Sequence[tuple[Variant, Experiment]]
    waiting: Sequence[str] = ()


def write_ablations_page(ablations: Sequence[Ablation], folder: Path, command: str) -> None:
    """Write `index.html`, `ablations.md` and `ablations.json`.

    Args:
        ablations: of one or several experiments, at least one variant each.
        folder: to write to.
        command: that makes the page again.

    Raises:
        InputError: the folder cannot be written.
    """
    page, text, figures = (folder / name for name in ("index.html", "ablations.md", "ablations.json"))
    write_report(page, _page(ablations, command))
    with replacing(text) as temporary:
        temporary.write_text(_markdown(ablations, folder, command), encoding="utf-8")
    with replacing(figures) as temporary:
        temporary.write_text(json.dumps(_json(ablations), indent=1) + "\n")


def scores_of(variant: Variant, experiment: Experiment) -> list[Mapping[str, float]]:
    """A variant's scores on held-out demonstrations: of each seed, or of a baseline, which has none."""
    if variant.learns:
        return list(experiment.summary["seeds"].values())
    return [experiment.summary["scores"][variant.column]]


def ablation_table(ablation: Ablation) -> Table:
    """A row a variant: scores, their mean over seeds and the least and greatest seed."""
    rows = []
    for variant, experiment in ablation.measured:
        scores = scores_of(variant, experiment)
        zero = score_text(_SUCCESS, experiment.summary["scores"][ZERO][_SUCCESS]) if variant.learns else ""
        rows.append((variant.name, *(_spread(name, [s[name] for s in scores if name in s]) for name in _SHOWN), zero))
    return Table(("", *_SHOWN.values(), "zero residual"), rows, _NOTE)


def _spread(name: str, values: Sequence[float]) -> str:
    """The mean with its unit, and the range of several values; "" of none."""
    if not values:
        return ""
    mean = score_text(name, float(np.mean(values)))
    least, greatest = (score_number(name, value) for value in (min(values), max(values)))
    if least == greatest:
        return mean
    return f"{mean} ({least} to {'100' if greatest == '100.0' else greatest})"


def _meanings(ablations: Sequence[Ablation]) -> dict[str, str]:
    """What each variant shows, and the options that make it."""
    return {
        variant.name: " ".join([variant.why, *(f"({override})" for override in variant.overrides)])
        for ablation in ablations
        for variant, _ in ablation.measured
    }


def _page(ablations: Sequence[Ablation], command: str) -> Report:
    hardware, packages = machine(*PACKAGES)
    return Report(
        title="mjx-hand: ablations",
        task=_TASK + _not_done(ablations),
        headlines=[headline for ablation in ablations for headline in _headlines(ablation)],
        sections=[
            section
            for ablation in ablations
            for section in (
                Section(f"{ablation.name}: held-out demonstrations", [ablation_table(ablation)]),
                Section(f"{ablation.name}: learning", _curves(ablation)),
            )
        ],
        how=[
            *_meanings(ablations).items(),
            *((ablation.name, _made_with(ablation)) for ablation in ablations),
            ("this machine", hardware),
            ("versions", packages),
        ],
        commands=[command],
    )


def _headlines(ablation: Ablation) -> list[Headline]:
    """The unchanged experiment's success, and the variant that loses most of it."""
    means = {v.name: float(np.mean([s[_SUCCESS] for s in scores_of(v, e)])) for v, e in ablation.measured if v.learns}
    unchanged = means.pop(UNCHANGED.name, None)
    if unchanged is None:
        return []
    shown = [Headline(f"{ablation.name}, {UNCHANGED.name}", score_text(_SUCCESS, unchanged))]
    if means:
        worst = min(means, key=lambda name: means[name])
        shown.append(Headline(f"least: {worst}", score_text(_SUCCESS, means[worst])))
    return shown


def _curves(ablation: Ablation) -> list[Plot]:
    """A figure a group, with the unchanged experiment in each."""
    learned = [(variant, experiment) for variant, experiment in ablation.measured if variant.learns]
    groups = list(dict.fromkeys(variant.group for variant, _ in learned if variant.group))
    plots = []
    for group in groups or [UNCHANGED.group]:
        lines = {v.name: _mean_curve(e) for v, e in learned if v.group in (UNCHANGED.group, group)}
        plots.append(Plot(learning_curves(lines, group, LEARNED), _LEARNING))
    return plots


def _mean_curve(experiment: Experiment) -> np.ndarray:
    """Rows of steps and success; seeds of one budget are checked at the same steps."""
    each = np.array([[(point.steps, point.success) for point in points] for points in experiment.curves.values()])
    return each.mean(axis=0)


def _made_with(ablation: Ablation) -> str:
    _, experiment = ablation.measured[0]
    summary = experiment.summary
    return (
        f"seeds {', '.join(summary['seeds'])}; {ablation.steps:,} control steps each; engine {summary['engine']}; "
        f"{summary['demonstrations']} held-out demonstrations"
    )


def _not_done(ablations: Sequence[Ablation]) -> str:
    waiting = [f"{ablation.name} ({', '.join(ablation.waiting)})" for ablation in ablations if ablation.waiting]
    return f" Not done yet: {'; '.join(waiting)}." if waiting else ""


def _markdown(ablations: Sequence[Ablation], folder: Path, command: str) -> str:
    lines = ["# Ablations", "", _TASK + _not_done(ablations), ""]
    for ablation in ablations:
        table = ablation_table(ablation)
        lines += [f"## {ablation.name}", "", f"{_made_with(ablation)}.", "", *markdown_rows(table), "", table.note, ""]
        lines += ["Every demonstration:", ""]
        for variant, experiment in ablation.measured:
            if variant.learns:
                where = Path(os.path.relpath(experiment.folder, folder)).as_posix()
                lines.append(f"- [{variant.name}](<{where}/evaluation.html>)")
        lines.append("")
    lines += ["## Variants", "", *(f"- {name}: {meaning}" for name, meaning in _meanings(ablations).items()), ""]
    lines += [*(f"- {line}" for line in machine(*PACKAGES)), "", f"    {command}"]
    return "\n".join(lines) + "\n"


def _json(ablations: Sequence[Ablation]) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "machine": machine(*PACKAGES),
        "experiments": {
            ablation.name: {
                "steps": ablation.steps,
                "waiting": list(ablation.waiting),
                "variants": {v.name: _json_of(v, e) for v, e in ablation.measured},
            }
            for ablation in ablations
        },
    }


def _json_of(variant: Variant, experiment: Experiment) -> dict[str, Any]:
    content = {**dataclasses.asdict(variant), "scores": experiment.summary["scores"][variant.column]}
    if variant.learns:
        content |= {
            "seeds": experiment.summary["seeds"],
            "zero residual": experiment.summary["scores"][ZERO],
            "failures": experiment.summary["failures"][POLICY],
            "curves": {seed: [dataclasses.asdict(p) for p in points] for seed, points in experiment.curves.items()},
        }
    return content
