"""The engines' figures as a Markdown table, a JSON file and a plot."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from envs.physics.native import cores
from mjx_hand.motion.archive import replacing
from mjx_hand.view import plots
from train.benchmark.contestants import Contestant
from train.benchmark.learning import Learning
from train.benchmark.machine import accelerator, machine, processor, versions
from train.benchmark.timing import Rate

SCHEMA = "mjx-hand/benchmark-engines/1"
_PACKAGES = ("mjx-hand", "mujoco", "mujoco-mjx", "jax", "jaxlib", "brax", "numpy")


@dataclasses.dataclass(frozen=True)
class Row:
    """What one contestant reached.

    Attributes:
        name, scope, worlds, compile_seconds: see `Contestant`.
        control_steps: a second, all worlds together; one is a transition of the environment.
        physics_steps: a second, at the median.
        real_time: simulated seconds a second in each world, at the median.
    """

    name: str
    scope: str
    worlds: int
    compile_seconds: float | None
    control_steps: Rate
    physics_steps: float
    real_time: float

    @classmethod
    def of(cls, contestant: Contestant, rate: Rate, dt: float, substeps: int) -> "Row":
        """The row of a contestant whose control steps last `dt` seconds and have so many substeps."""
        return cls(
            name=contestant.name,
            scope=contestant.scope,
            worlds=contestant.worlds,
            compile_seconds=contestant.compile_seconds,
            control_steps=rate,
            physics_steps=rate.median * substeps,
            real_time=rate.median * dt / contestant.worlds,
        )


@dataclasses.dataclass(frozen=True)
class Results:
    """All that was measured.

    Attributes:
        rows: one a contestant.
        learning: of training, where it was asked for.
        missing: engines that are not here, and how to install them.
        substeps, dt: physics steps and simulated seconds a control step.
    """

    rows: Sequence[Row]
    learning: Learning | None
    missing: Mapping[str, str]
    substeps: int
    dt: float


def text(results: Results) -> list[str]:
    """The report in Markdown."""
    lines = [
        "## Physics engines on the pinch scene",
        "",
        *machine(*_PACKAGES),
        f"A control step is {results.substeps} physics steps, {1e3 * results.dt:g} ms. Compare rows of one kind:",
        "*physics* starts anew all over the demonstrations, *environment* goes where random actions lead, so that",
        "a step of one is not the same work as a step of the other.",
        "",
        "| | what | worlds | control steps/s: median (least to greatest) | physics steps/s | × real time, a world "
        "| compiling, s |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]
    for row in results.rows:
        compiling = "" if row.compile_seconds is None else f"{row.compile_seconds:.1f}"
        cells = (
            f"{row.name} | {row.scope} | {row.worlds:,} | {_rate(row.control_steps)} | {row.physics_steps:,.0f} "
            f"| {row.real_time:.2f} | {compiling}"
        )
        lines.append(f"| {cells} |")
    lines += [f"| {name} | {why} | | | | | |" for name, why in results.missing.items()]
    if results.learning is not None:
        lines += ["", *_learning_table(results.learning)]
    return lines


def _learning_table(learning: Learning) -> list[str]:
    share = f"{100 * learning.physics_share:.0f} % (estimate)"
    return [
        "| training with PPO on | worlds | control steps/s: median (least to greatest) | physics | compiling, s |",
        "|---|---:|---:|---:|---:|",
        f"| {learning.engine} | {learning.worlds:,} | {_rate(learning.rate)} | {share} "
        f"| {learning.compile_seconds:.1f} |",
    ]


def _rate(rate: Rate) -> str:
    return f"{rate.median:,.0f} ({rate.least:,.0f} to {rate.greatest:,.0f})"


def write(results: Results, folder: Path, options: Mapping[str, Any]) -> tuple[Path, Path]:
    """Write `engines.json` and `engines.png`, and return their paths.

    Raises:
        InputError: the folder cannot be written.
    """
    content = {
        "schema": SCHEMA,
        "machine": {"processor": processor(), "cores": cores(), "accelerator": accelerator()},
        "versions": versions(*_PACKAGES),
        "options": options,
        **dataclasses.asdict(results),
    }
    figures, plot = folder / "engines.json", folder / "engines.png"
    with replacing(figures) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n")
    plots.save_figure(plots.throughput(_curves(results.rows), label="control steps/s"), plot)
    return figures, plot


def _curves(rows: Sequence[Row]) -> dict[str, np.ndarray]:
    curves: dict[str, list[tuple[float, ...]]] = {}
    for row in rows:
        curve = curves.setdefault(f"{row.name}, {row.scope}", [])
        curve.append((row.worlds, *dataclasses.astuple(row.control_steps)))
    return {name: np.array(curve, float) for name, curve in curves.items()}
