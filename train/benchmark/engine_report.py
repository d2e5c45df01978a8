"""The engines' figures as a Markdown table, a JSON file and a plot."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.view.figures import plots
from train.benchmark.contestants import Contestant, Memory
from train.benchmark.learning import Learning
from train.benchmark.report_files import write_report
from train.benchmark.timing import Rate
from train.reports.machine import machine

SCHEMA = "mjx-hand/benchmark-engines/2"
_PACKAGES = ("mjx-hand", "mujoco", "mujoco-mjx", "jax", "jaxlib", "brax", "numpy")


@dataclasses.dataclass(frozen=True)
class Row:
    """What one contestant reached.

    Attributes:
        grasp: type of the scene.
        name, scope, worlds, compile_seconds, memory: see `Contestant`.
        control_steps: a second, all worlds together; one is a transition of the environment.
        physics_steps: a second, at the median.
        real_time: simulated seconds a second in each world, at the median.
    """

    grasp: str
    name: str
    scope: str
    worlds: int
    compile_seconds: float | None
    memory: Memory | None
    control_steps: Rate
    physics_steps: float
    real_time: float

    @classmethod
    def of(cls, grasp: str, contestant: Contestant, rate: Rate, dt: float, substeps: int) -> "Row":
        """The row of a contestant whose control steps last `dt` seconds and have so many substeps."""
        return cls(
            grasp=grasp,
            name=contestant.name,
            scope=contestant.scope,
            worlds=contestant.worlds,
            compile_seconds=contestant.compile_seconds,
            memory=contestant.memory,
            control_steps=rate,
            physics_steps=rate.median * substeps,
            real_time=rate.median * dt / contestant.worlds,
        )


@dataclasses.dataclass(frozen=True)
class Results:
    """All that was measured.

    Attributes:
        rows: one a contestant and grasp type.
        learning: of training, where it was asked for.
        notes: what was not measured, a line each.
        substeps, dt: physics steps and simulated seconds a control step.
    """

    rows: Sequence[Row]
    learning: Sequence[Learning]
    notes: Sequence[str]
    substeps: int
    dt: float


def text(results: Results) -> list[str]:
    """The report in Markdown."""
    lines = [
        "## Physics engines",
        "",
        *machine(*_PACKAGES),
        "",
        f"A control step is {results.substeps} physics steps, {1e3 * results.dt:g} ms. Compare rows of one kind:",
        "*physics* starts anew all over the demonstrations, *environment* goes where random actions lead, so that",
        "a step of one is not the same work as a step of the other. Memory is what the process grew by at its peak,",
        "compiling included.",
        *(["", *(f"- {note}" for note in results.notes)] if results.notes else []),
        "",
        "| grasp | native, best: physics steps/s | of mjx's best | of warp's best | of mujoco.rollout's, same worlds "
        "| one world, × real time |",
        "|---|---:|---:|---:|---:|---:|",
        *(_summary(grasp, rows) for grasp, rows in _by_grasp(results.rows).items()),
        "",
        "| grasp | | what | worlds | control steps/s: median (least to greatest) | physics steps/s "
        "| × real time, a world | compiling, s | memory, MiB | of the device |",
        "|---|---|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in results.rows:
        cells = (
            row.grasp,
            row.name,
            row.scope,
            f"{row.worlds:,}",
            _rate(row.control_steps),
            f"{row.physics_steps:,.0f}",
            f"{row.real_time:.2f}",
            "" if row.compile_seconds is None else f"{row.compile_seconds:.1f}",
            _mebibytes(row.memory and row.memory.host),
            _mebibytes(row.memory and row.memory.device),
        )
        lines.append(f"| {' | '.join(cells)} |")
    if results.learning:
        lines += ["", *_learning_table(results.learning)]
    return lines


def _by_grasp(rows: Sequence[Row]) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row.grasp, []).append(row)
    return found


def _summary(grasp: str, rows: Sequence[Row]) -> str:
    """What the rows of one type say about the native engine, empty where there is nothing to compare it with."""

    def speeds(name: str) -> dict[int, float]:
        return {row.worlds: row.physics_steps for row in rows if (row.name, row.scope) == (name, "physics")}

    native, rollout = speeds("native"), speeds("mujoco.rollout")
    cells = [grasp, f"{max(native.values()):,.0f}" if native else ""]
    for name in ("mjx", "warp"):
        others = speeds(name)
        cells.append(f"{max(native.values()) / max(others.values()):.1f} ×" if native and others else "")
    shares = [native[count] / rollout[count] for count in native if count > 1]
    cells.append(f"{min(shares):.2f} to {max(shares):.2f} ×" if shares else "")
    cells += [f"{row.real_time:.0f}" for row in rows if (row.name, row.scope, row.worlds) == ("native", "physics", 1)]
    return f"| {' | '.join([*cells, ''][:6])} |"


def _mebibytes(size: int | None) -> str:
    return "" if size is None else f"{size / 2**20:,.0f}"


def _learning_table(learning: Sequence[Learning]) -> list[str]:
    return [
        "| grasp | training with PPO on | worlds | control steps/s: median (least to greatest) | physics, about "
        "| learner, about | compiling, s |",
        "|---|---|---:|---:|---:|---:|---:|",
        *(
            f"| {one.grasp} | {one.engine} | {one.worlds:,} | {_rate(one.rate)} | {one.physics_share:.0%} "
            f"| {one.learner_share:.0%} | {one.compile_seconds:.1f} |"
            for one in learning
        ),
    ]


def _rate(rate: Rate) -> str:
    return f"{rate.median:,.0f} ({rate.least:,.0f} to {rate.greatest:,.0f})"


def write(results: Results, lines: Sequence[str], folder: Path, options: Mapping[str, Any]) -> tuple[Path, ...]:
    """Write `engines.md`, `engines.json` and `engines.png`, and return their paths.

    Raises:
        InputError: the folder cannot be written.
    """
    content = {"options": options, **dataclasses.asdict(results)}
    page, figures = write_report(folder, "engines", lines, SCHEMA, _PACKAGES, content)
    plot = folder / "engines.png"
    panels = {grasp: _curves(rows) for grasp, rows in _by_grasp(results.rows).items()}
    plots.save_figure(plots.throughput(panels, label="physics steps/s"), plot)
    return page, figures, plot


def _curves(rows: Sequence[Row]) -> dict[str, np.ndarray]:
    """Of each engine alone: worlds, and physics steps a second at the median, the least and the greatest."""
    curves: dict[str, list[tuple[float, ...]]] = {}
    for row in rows:
        if row.scope == "physics":
            rate = row.control_steps
            each = row.physics_steps / rate.median
            spread = (row.physics_steps, each * rate.least, each * rate.greatest)
            curves.setdefault(row.name, []).append((row.worlds, *spread))
    return {name: np.array(curve, float) for name, curve in curves.items()}
