"""The solver's figures as Markdown tables and a JSON file."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from train.benchmark.report_files import write_report
from train.reports.machine import machine

SCHEMA = "mjx-hand/benchmark-solver/1"
_PACKAGES = ("mjx-hand", "mujoco", "numpy")


@dataclasses.dataclass(frozen=True)
class Figures:
    """What one setting came to on one grasp type; None where nothing was held.

    Attributes:
        steps: physics steps a second of CPU time, median of the runs; so other programs on the machine count little.
        simulated: the seconds that they simulate.
        scripts, held: how many grasps were tried, and held.
        shaking: RMS acceleration (m/s^2) of an object that is held still, median over those held.
        deviation: mean distance (m) of an object's path from the converged one's, median over grasps that hold there.
        mean_depth, deepest: of the hand's contacts with objects that are held (m).
    """

    steps: float
    simulated: float
    scripts: int
    held: int
    shaking: float | None
    deviation: float | None
    mean_depth: float | None
    deepest: float | None


def text(figures: Mapping[str, Mapping[str, Figures]], chosen: str) -> list[str]:
    """The report in Markdown: all types together, and each by itself.

    Args:
        figures: by grasp type and setting.
        chosen: the setting that speeds are told relative to.
    """
    lines = [
        "## Solver settings",
        "",
        *machine(*_PACKAGES),
        "",
        "Rows say in what they depart from the first. *Speed*: simulated seconds a second of CPU time, the first row's",
        "being 1: mean, least and greatest of the types. *Held*: scripted grasps. *Shaking*: RMS acceleration of an",
        "object held still, of the worst type. *Off*: mean distance of the object's path from that of Newton's method",
        "run to the end at 1 ms, of the worst type. *Depth*: of the hand in objects that it holds.",
        "",
        "| settings | speed | held | shaking, m/s² | off, mm | depth: mean, mm | deepest, mm |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    names = list(next(iter(figures.values())))
    for name in names:
        rows = [of_type[name] for of_type in figures.values()]
        ratios = [of_type[name].simulated / of_type[chosen].simulated for of_type in figures.values()]
        speed = f"{np.exp(np.mean(np.log(ratios))):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
        held = f"{sum(row.held for row in rows)} of {sum(row.scripts for row in rows)}"
        depth = [row.mean_depth for row in rows if row.mean_depth is not None]
        cells = (
            speed,
            held,
            _most([row.shaking for row in rows], 1.0, 2),
            _most([row.deviation for row in rows], 1e3, 1),
            _most([float(np.mean(depth)) if depth else None], 1e3, 2),
            _most([row.deepest for row in rows], 1e3, 2),
        )
        lines.append(f"| {name} | {' | '.join(cells)} |")
    for grasp, of_type in figures.items():
        lines += [
            "",
            f"### {grasp}",
            "",
            "| settings | physics steps/CPU s | simulated s/CPU s | held | shaking, m/s² | off, mm | depth: mean, mm "
            "| deepest, mm |",
            "|---|---:|---:|---:|---:|---:|---:|---:|",
        ]
        for name, row in of_type.items():
            cells = (
                f"{row.steps:,.0f}",
                f"{row.simulated:,.0f}",
                f"{row.held} of {row.scripts}",
                _most([row.shaking], 1.0, 2),
                _most([row.deviation], 1e3, 1),
                _most([row.mean_depth], 1e3, 2),
                _most([row.deepest], 1e3, 2),
            )
            lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def _most(values: Sequence[float | None], unit: float, digits: int) -> str:
    known = [value for value in values if value is not None]
    return f"{unit * max(known):.{digits}f}" if known else "–"


def write(
    figures: Mapping[str, Mapping[str, Figures]], lines: Sequence[str], folder: Path, options: Mapping[str, Any]
) -> tuple[Path, Path]:
    """Write `solver.md` and `solver.json`, and return their paths.

    Raises:
        InputError: the folder cannot be written.
    """
    content = {
        "options": options,
        "grasps": {
            grasp: {name: dataclasses.asdict(row) for name, row in of_type.items()}
            for grasp, of_type in figures.items()
        },
    }
    return write_report(folder, "solver", lines, SCHEMA, _PACKAGES, content)
