"""The host beside the GPU: the C engine alone and training on it, and its physics with the learner on the GPU."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from train.benchmark.gpu.bench import Bench
from train.benchmark.gpu.learning import SPEED_COLUMNS, speed
from train.benchmark.gpu.record import Record

_NEEDS = 60.0  # seconds on a GPU's host, for each of the two


def on_host(bench: Bench, record: Record, keep: Callable[[], None]) -> None:
    """A process of its own, which has no GPU, measures the C engine and PPO; then this one trains with both.

    Raises:
        RuntimeError: the process failed.
    """
    patience = _NEEDS * bench.scale.patience
    table = record.table(*SPEED_COLUMNS)
    if bench.enough(record, "native physics on the host, learner where JAX computes", patience):
        speed(bench, "native", "native physics, learner where JAX computes", bench.scale.host_worlds, table)
        keep()
    if bench.enough(record, "native alone", patience):
        alone = record.table("contestant", "what", "worlds", "physics steps/s", "control steps/s")
        found = _engines_without_gpu(bench)
        for row in found["rows"]:
            alone.add(row["name"], row["scope"], row["worlds"], row["physics_steps"], row["control_steps"]["median"])
        for one in found["learning"]:
            rate, shares = one["rate"], (f"{one[part]:.0%}" for part in ("physics_share", "learner_share"))
            rates = (rate["median"], rate["least"], rate["greatest"])
            table.add(one["grasp"], "native, all on the CPU", one["worlds"], *rates, *shares, one["compile_seconds"])
        keep()


def _engines_without_gpu(bench: Bench) -> dict[str, Any]:
    """The figures of `train.benchmark engines` on the pinch, as a machine without a GPU has them."""
    folder: Path = bench.out / "host"
    scale = bench.scale
    options = {
        "--grasps": ["pinch"],
        "--engines": ["native"],
        "--worlds": [scale.host_worlds],
        "--runs": [scale.runs],
        "--seconds": [scale.seconds],
        "--out": [folder],
        "--demonstrations": [bench.demonstrations],
    }
    words = [str(word) for name, values in options.items() for word in (name, *values)]
    done = subprocess.run(
        [sys.executable, "-m", "train.benchmark", "engines", "--ppo", *words],
        env={**os.environ, "JAX_PLATFORMS": "cpu"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        timeout=bench.budget.left(),
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"train.benchmark engines ended with status {done.returncode}: {done.stderr[-500:]}")
    return json.loads((folder / "engines.json").read_text())
