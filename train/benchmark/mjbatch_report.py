"""The figures of the `mjbatch` benchmark as Markdown tables and a JSON file."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from train.benchmark.report_files import write_report
from train.benchmark.timing import Rate
from train.reports.machine import machine

SCHEMA = "mjx-hand/benchmark-mjbatch/1"
_PACKAGES = ("mjx-hand", "mujoco", "jax", "jaxlib", "numpy")
_POSITION = slice(-7, -4)  # of the object, in qpos


@dataclasses.dataclass(frozen=True)
class Row:
    """What one entrant reached, beside the native engine in the same rounds.

    Attributes:
        setting: of the solver.
        name, worlds: of the entrant.
        steps: physics steps a second, all worlds together.
        steps_of_cpu: the same a second of CPU time.
        native, native_of_cpu: how many times as fast the native engine was; 1 in its own row.
        apart: how far the object ends from where the native engine has it (m), median and greatest of the worlds.
    """

    setting: str
    name: str
    worlds: int
    steps: Rate
    steps_of_cpu: Rate
    native: Rate
    native_of_cpu: Rate
    apart: tuple[float, float]

    @classmethod
    def of_all(
        cls,
        setting: str,
        names: Sequence[str],
        worlds: int,
        rates: Float[np.ndarray, "e r 2"],
        ends: Sequence[Float[np.ndarray, "n nq"]],
    ) -> list["Row"]:
        """A row each, the native engine's first.

        Args:
            setting, worlds: see above.
            names: of the entrants.
            rates: physics steps a second of wall and of CPU time, of each entrant in each round.
            ends: the generalised positions that a pass led each to.
        """
        rows = []
        for name, rate, end in zip(names, rates, ends, strict=True):
            off = np.linalg.norm(np.float32(end[:, _POSITION]) - np.float32(ends[0][:, _POSITION]), axis=-1)
            steps, steps_of_cpu = (Rate.of(each) for each in rate.T.tolist())
            native, native_of_cpu = (Rate.of(each) for each in (rates[0] / rate).T.tolist())
            apart = (float(np.median(off)), float(off.max()))
            rows.append(cls(setting, name, worlds, steps, steps_of_cpu, native, native_of_cpu, apart))
        return rows


@dataclasses.dataclass(frozen=True)
class Results:
    """All that was measured.

    Attributes:
        rows: one an entrant, number of worlds and setting.
        notes: what was not measured, and what else to know, a line each.
        threads: that step worlds, at most one a world.
        theirs: versions of mjbatch and of its MuJoCo; empty where it was not measured.
    """

    rows: Sequence[Row]
    notes: Sequence[str]
    threads: int
    theirs: Mapping[str, str]


def text(results: Results) -> list[str]:
    """The report in Markdown."""
    theirs = [f"beside it: {', '.join(f'{name} {number}' for name, number in results.theirs.items())}"]
    lines = [
        "## The native engine and mjbatch",
        "",
        *machine(*_PACKAGES),
        *(theirs if results.theirs else []),
        "",
        f"Pinches, {results.threads} threads, elliptic cones, impratio 50. Medians (least to greatest) of rounds.",
        "*Native*: how many times as fast it was as the row in the same round. *Apart*: how far the object ends from",
        "where native has it after a pass, median / greatest of the worlds.",
        *(["", *(f"- {note}" for note in results.notes)] if results.notes else []),
        "",
        "| solver | worlds | | physics steps/s | native, × | a second of CPU time | native, × | apart, µm |",
        "|---|---:|---|---:|---:|---:|---:|---:|",
    ]
    for row in results.rows:
        cells = (
            row.setting,
            f"{row.worlds:,}",
            row.name,
            _rate(row.steps, ",.0f"),
            _rate(row.native, ".2f"),
            f"{row.steps_of_cpu.median:,.0f}",
            _rate(row.native_of_cpu, ".2f"),
            " / ".join(f"{1e6 * off:.3g}" for off in row.apart),
        )
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _rate(rate: Rate, form: str) -> str:
    return f"{rate.median:{form}} ({rate.least:{form}} to {rate.greatest:{form}})"


def write(results: Results, lines: Sequence[str], folder: Path, options: Mapping[str, Any]) -> tuple[Path, Path]:
    """Write `mjbatch.md` and `mjbatch.json`, and return their paths.

    Raises:
        InputError: the folder cannot be written.
    """
    content = {"options": options, **dataclasses.asdict(results)}
    return write_report(folder, "mjbatch", lines, SCHEMA, _PACKAGES, content)
