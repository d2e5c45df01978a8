"""All experiments in one table: a row an experiment, and their mean."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from envs.grasps import FIVE
from mjx_hand.view.report import Table
from train.experiment.evaluate_seeds import POLICY, PRESS, REPLAY, ZERO
from train.learning.curve import LEARNED, Point, minutes_to_learn
from train.reports.published import PAPER, Published
from train.reports.score_table import score_text, share_text


@dataclasses.dataclass(frozen=True)
class Experiment:
    """A trained and evaluated experiment.

    Attributes:
        name: of the experiment.
        folder: of its evaluation.
        summary: what `evaluation.json` says.
        curves: the evaluations while training, by seed.
        stress: what `stress.json` says; None where it was not asked for.
    """

    name: str
    folder: Path
    summary: Mapping[str, Any]
    curves: Mapping[int, Sequence[Point]]
    stress: Mapping[str, Any] | None = None

    @property
    def paper(self) -> Published | None:
        return PAPER.get(self.summary["grasp"])


_KEPT, _SUCCESS = "kept", "manip_trans_object"
_ERROR, _MOVING, _TURN = "tracking_error_cm", "moving_error_cm", "object_rotation_error_deg"
_COLUMNS = (
    *("", "followed", "least seed", "least person", "constant press", "zero residual", "demonstration alone"),
    *("CHORD", "held 5 s", "ManipTrans", "constant press, ManipTrans", "ManipTrans, each frame", "paper's success"),
    *("tracking error", "while moving", "paper's tracking error", "rotation error"),
    *(f"minutes to {100 * LEARNED:.0f} %", "minutes of training"),
)
_NOTE = (
    "Followed: never past 10 cm, 0.5 rad and wrist 15 cm (CHORD), and still held 5 s after the end; in brackets the "
    "95 % interval over all rollouts (Wilson). ManipTrans: mean errors of the object below 3 cm and 30°, or, by its "
    "code, no frame past 2 cm, 30° and its bounds for the hand. The paper does not define its success. Means over "
    "seeds; every rollout of every demonstration counts, from frame 0, unassisted. Constant press, zero "
    "residual and demonstration alone: nothing learned, followed; the press is one strength for each type, the best "
    "on the training demonstrations. While moving: from when the object is to move. Minutes of one training, "
    f"until its check on the training demonstrations first reached {100 * LEARNED:.0f} %, and until its end."
)


def results_table(experiments: Sequence[Experiment]) -> Table:
    """What was followed, errors and training times of every experiment beside the paper's, and their mean."""
    rows = [_row(experiment.name, [experiment], experiment.paper) for experiment in experiments]
    if len(experiments) > 1:
        all_five = sorted(experiment.summary["grasp"] for experiment in experiments) == sorted(FIVE)
        rows.append(_row("mean", experiments, PAPER["all"] if all_five else None))
    return Table(_COLUMNS, rows, _NOTE)


def failures_table(experiments: Sequence[Experiment]) -> Table:
    """Every failed rollout of every policy, with its reason."""
    rows = [
        (
            f"{experiment.name}, demonstration {failed['demonstration']}",
            f"seed {failed['seed']}",
            failed["reason"],
            *(score_text(name, failed[name]) for name in (_ERROR, _TURN)),
        )
        for experiment in experiments
        for failed in sorted(experiment.summary["failed"], key=lambda f: (f["demonstration"], f["seed"]))
    ]
    return Table(("", "policy", "reason", "tracking error", "rotation error"), rows)


def minutes_of(curves: Mapping[int, Sequence[Point]]) -> tuple[list[float], list[float]]:
    """Minutes to learn of the seeds that did, and minutes in total of all."""
    learned = [minutes for points in curves.values() if (minutes := minutes_to_learn(points)) is not None]
    return learned, [points[-1].seconds / 60 for points in curves.values()]


def _row(title: str, experiments: Sequence[Experiment], paper: Published | None) -> tuple[str, ...]:
    def mean(column: str, name: str) -> str:
        values = [scores[name] for e in experiments if name in (scores := e.summary["scores"][column])]
        return score_text(name, float(np.mean(values))) if len(values) == len(experiments) else ""

    return (
        title,
        _followed(experiments) or mean(POLICY, _KEPT),
        _least_seed(experiments),
        _least_person(experiments),
        *(mean(baseline, _KEPT) for baseline in (PRESS, ZERO, REPLAY)),
        *(mean(POLICY, name) for name in ("chord", "hold", _SUCCESS)),
        mean(PRESS, _SUCCESS),
        mean(POLICY, "manip_trans_frames"),
        score_text(_SUCCESS, paper.success) if paper else "",
        *(mean(POLICY, name) for name in (_ERROR, _MOVING)),
        score_text(_ERROR, paper.tracking_error_cm) if paper else "",
        mean(POLICY, _TURN),
        *_minutes(experiments),
    )


def _followed(experiments: Sequence[Experiment]) -> str:
    """What one experiment's policies kept, with its interval; "" for several, whose rollouts are of other kinds."""
    if len(experiments) > 1:
        return ""
    summary = experiments[0].summary
    low, high = summary["intervals"][POLICY][_KEPT]
    return share_text(summary["scores"][POLICY][_KEPT], (low, high))


def _least_seed(experiments: Sequence[Experiment]) -> str:
    """What the least seed kept, each seed's own mean over the experiments; they must have the same seeds."""
    seeds = {tuple(experiment.summary["seeds"]) for experiment in experiments}
    if len(seeds) > 1:
        return ""
    means = [np.mean([e.summary["seeds"][seed][_KEPT] for e in experiments]) for seed in seeds.pop()]
    return score_text(_KEPT, float(min(means)))


def _least_person(experiments: Sequence[Experiment]) -> str:
    """What was kept of the demonstrations of the person with least, of all experiments."""
    people = [scores[_KEPT] for experiment in experiments for scores in experiment.summary["people"].values()]
    return score_text(_KEPT, min(people)) if people else ""


def _minutes(experiments: Sequence[Experiment]) -> tuple[str, str]:
    each = [minutes_of(experiment.curves) for experiment in experiments]
    learned = [minutes for some, _ in each for minutes in some]
    total = [minutes for _, every in each for minutes in every]
    if not learned:
        return "not reached", f"{np.mean(total):.1f}"
    few = "" if len(learned) == len(total) else f" ({len(learned)} of {len(total)})"
    return f"{np.mean(learned):.1f}{few}", f"{np.mean(total):.1f}"
