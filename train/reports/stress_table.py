"""What policies and the constant press do under disturbances, as a table, curves and a file."""

import csv
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from envs.evaluation.evaluate import Evaluation
from mjx_hand.files.npz_archive import replacing
from mjx_hand.view.figures.stress_figure import shares_over
from mjx_hand.view.report import Table
from train.experiment.evaluate_seeds import PART_WORDS, POLICY, PRESS, shared_folder
from train.experiment.stress import CURVES, Stress
from train.reports.evaluation_record import evaluation_fingerprint, made_of, mean_scores, rollout_rows
from train.reports.interval import wilson
from train.settings.config import Config

SCHEMA = "mjx-hand/stress/1"
_SCORES = {"CHORD": "chord", "held": "hold", "ManipTrans": "manip_trans_object"}


def stress_table(stress: Stress) -> Table:
    """A row a disturbance; of several seeds all rollouts together, with 95 % intervals (Wilson)."""
    rows = [
        (row, *(cell for each in (list(policies.values()), [stress.press[row]]) for cell in _cells(each)))
        for row, policies in stress.policies.items()
    ]
    seeds, count = len(next(iter(stress.policies.values()))), len(next(iter(stress.press.values())).demonstration)
    names = " / ".join(name for name, score in _SCORES.items() if score in next(iter(stress.press.values())).scores)
    columns = ("disturbance", POLICY, names, PRESS, names)
    strengths = ", ".join(f"{grasp} {constant}" for grasp, constant in stress.strengths.items())
    note = (
        f"%; {count} {PART_WORDS[stress.part]}, {seeds} seed{'s' if seeds > 1 else ''}, every rollout counted, from "
        "frame 0; neither is told of the disturbance. First the share that is never lost (CHORD) and still held, with "
        "its 95 % interval (Wilson). Constant press: the best in each row of what searches on the training "
        f"demonstrations found, {stress.searched}: {strengths}"
    )
    return Table(columns, rows, note)


def stress_figure(stress: Stress) -> Figure:
    """Share that is kept over the size of a disturbance, a panel each."""

    def curve(places: Mapping[float, str], of: Callable[[str], Sequence[Evaluation]]) -> np.ndarray:
        return np.array([(value, *_interval(of(row))) for value, row in places.items()])

    columns = {
        POLICY: lambda row: list(stress.policies[row].values()),
        PRESS: lambda row: [stress.press[row]],
    }
    panels = {varied: {name: curve(places, of) for name, of in columns.items()} for varied, places in CURVES.items()}
    return shares_over(panels)


def write_stress(stress: Stress, folder: Path, configs: Sequence[Config]) -> None:
    """Write `stress.json` (a share and its interval for each row) and `stress.csv` (every rollout)."""
    rows = {
        row: {
            POLICY: _told(list(policies.values())),
            PRESS: _told([stress.press[row]]),
            "seeds": {seed: _told([evaluation]) for seed, evaluation in policies.items()},
        }
        for row, policies in stress.policies.items()
    }
    content = {
        "schema": SCHEMA,
        "part": stress.part,
        "constant_press": dict(stress.strengths),
        "rows": rows,
        "made_of": evaluation_fingerprint(configs),
    }
    with replacing(folder / "stress.json") as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n")
    with replacing(folder / "stress.csv") as temporary, temporary.open("w", newline="") as file:
        names = list(next(iter(stress.press.values())).scores)
        written = csv.writer(file)
        written.writerow(["row", "column", "seed", "demonstration", *names, "failure"])
        for row, policies in stress.policies.items():
            for column, seed, e in [*((POLICY, s, e) for s, e in policies.items()), (PRESS, "", stress.press[row])]:
                written.writerows([row, column, seed, *cells] for cells in rollout_rows(e, names))


def cached_stress(configs: Sequence[Config]) -> dict[str, Any] | None:
    """What `stress.json` says of the very same policies with the same settings, None where there is none."""
    return made_of(shared_folder(configs) / "stress.json", configs)


def _told(evaluations: Sequence[Evaluation]) -> Mapping[str, float]:
    share, low, high = _interval(evaluations)
    return {"kept_low": low, "kept_high": high, **mean_scores([e.rows() for e in evaluations]), "kept": share}


def _interval(evaluations: Sequence[Evaluation]) -> tuple[float, float, float]:
    """Share of rollouts that are kept, and its 95 % interval."""
    success = np.concatenate([e.scores["kept"] for e in evaluations])
    return float(success.mean()), *wilson(success)


def _cells(evaluations: Sequence[Evaluation]) -> tuple[str, str]:
    share, low, high = (100 * value for value in _interval(evaluations))
    scores = mean_scores([e.rows() for e in evaluations])
    means = [100 * scores[name] for name in _SCORES.values() if name in scores]
    return f"{share:.1f} ({low:.0f} to {high:.0f})", " / ".join(f"{mean:.1f}" for mean in means)
