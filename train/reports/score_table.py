"""Evaluations as tables for reports: a row a metric, a column a policy, and the paper's figures beside them."""

from collections.abc import Mapping, Sequence

import numpy as np

from envs.evaluation.evaluate import Evaluation
from envs.evaluation.failure import FAILURES
from mjx_hand.errors import InputError
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.view.report import Table
from train.reports.interval import intervals
from train.reports.published import Published

TITLES = {
    "kept": "followed: never lost, and held to the end",
    "chord": "CHORD: never past 10 cm, 0.5 rad, wrist 15 cm",
    "hold": "still held 5 s later, slip below 2 cm",
    "manip_trans_object": "ManipTrans, object: means below 3 cm and 30°",
    "manip_trans_full": "ManipTrans: also joints below 8 cm, tips below 6 cm",
    "manip_trans_frames": "ManipTrans, no frame past 2 cm, 30°, tips 4 to 6 cm, joints 7 and 8 cm",
    "spider": "SPIDER: means below 10 cm and 0.5 rad",
    "add_auc": "ADD-AUC, 1 to 9 cm",
    "tracking_error_cm": "tracking error, mean over all rollouts",
    "moving_error_cm": "tracking error from when the object is to move",
    "object_rotation_error_deg": "object rotation error",
    "moving_rotation_error_deg": "object rotation error from when it is to move",
    "grip_force_newton": "grip force from then on, sum over the links",
    "grip_force_ratio": "grip force over the least that carries the object",
    "joint_error_cm": "joint position error",
    "tip_error_cm": "finger tip position error",
}


def score_table(
    evaluations: Mapping[str, Sequence[Evaluation]], paper: Published | None = None, note: str = ""
) -> Table:
    """Every metric of every evaluation, and the paper's column where it is given.

    Args:
        evaluations: column title to its evaluations, one a seed. Several give two columns: the mean over the seeds,
            and the range from the least seed to the greatest. Shares have their 95 % interval (Wilson) beside them,
            over all seeds' rollouts.
        paper: the paper's row for the same grasp type; its success, which it does not define, gets a row of its own.
        note: printed below the table.

    Raises:
        InputError: no evaluations.
    """
    if not evaluations:
        raise InputError("no evaluations to show; give at least one column")
    means = {title: [e.rows() for e in each] for title, each in evaluations.items()}
    bounds = {title: intervals(each) for title, each in evaluations.items()}
    columns = [column for title, each in means.items() for column in _columns(title, len(each))]
    rows = []
    for name, title in TITLES.items():
        cells = [
            cell
            for title, each in means.items()
            for cell in _cells(name, [row.get(name) for row in each], bounds[title].get(name))
        ]
        published = [score_text(name, paper.tracking_error_cm) if name == "tracking_error_cm" else ""] if paper else []
        if any(cells):
            rows.append((title, *cells, *published))
    if paper:
        rows.insert(0, ("success, by the paper's own count", *[""] * len(columns), f"{100 * paper.success:.1f} %"))
    return Table(("", *columns, *(["paper"] if paper else [])), rows, note)


def failure_table(evaluations: Mapping[str, Sequence[Evaluation]], note: str = "") -> Table:
    """How rollouts failed ManipTrans' object criterion, as shares of all rollouts of all seeds."""
    shares = [[e.failure_shares() for e in each] for each in evaluations.values()]
    rows = [(reason, *(f"{100 * np.mean([s[reason] for s in each]):.1f} %" for each in shares)) for reason in FAILURES]
    return Table(("", *evaluations), rows, note)


def demonstration_table(
    policies: Mapping[int, Evaluation], baselines: Mapping[str, Evaluation], objects: Sequence[ObjectDescription]
) -> Table:
    """A row a demonstration: its object, and what became of it under each seed's policy and each baseline.

    Args:
        policies: seed to its evaluation, one rollout a demonstration.
        baselines: title to its evaluation, likewise.
        objects: each demonstration's object.
    """
    columns = {f"seed {seed}": e for seed, e in policies.items()} | dict(baselines)
    rows = [(f"{k}: {object_text(obj)}", *(_outcome(e, k) for e in columns.values())) for k, obj in enumerate(objects)]
    return Table(("demonstration", *columns), rows, "Tracking error (cm), and why it failed where it did.")


def failed_table(policies: Mapping[int, Evaluation]) -> Table:
    """Every failed rollout of every seed and its reason (`failure.failure_reasons`), by demonstration."""
    failed = sorted(
        (int(e.demonstration[k]), seed, reason, k)
        for seed, e in policies.items()
        for k, reason in enumerate(e.failure)
        if reason
    )
    rows = [
        (
            f"demonstration {demonstration}",
            f"seed {seed}",
            reason + _from_frame(policies[seed], k),
            *(score_text(n, policies[seed].scores[n][k]) for n in ("tracking_error_cm", "object_rotation_error_deg")),
        )
        for demonstration, seed, reason, k in failed
    ]
    return Table(("", "policy", "reason", "tracking error", "rotation error"), rows, _REASONS)


def _from_frame(evaluation: Evaluation, k: int) -> str:
    return f", from frame {evaluation.lost[k]}" if evaluation.lost and evaluation.lost[k] >= 0 else ""


def object_text(obj: ObjectDescription) -> str:
    """An object in words: kind, size in mm, mass in g and friction."""
    mm = [f"{1000 * value:.0f}" for value in 2 * np.asarray(obj.size)]
    sizes = {
        "sphere": f"⌀ {mm[0]}",
        "cylinder": f"⌀ {mm[0]} × {mm[1]}",
        "capsule": f"⌀ {mm[0]} × {1000 * 2 * (obj.size[0] + obj.size[1]):.0f}",
    }
    size = sizes.get(obj.kind, " × ".join(mm))
    return f"{obj.kind} {size} mm, {1000 * float(obj.mass):.0f} g, friction {float(obj.friction):.2f}"


def share_text(share: float, interval: tuple[float, float]) -> str:
    """A share and its 95 % interval."""
    return f"{100 * share:.1f} % ({100 * interval[0]:.0f} to {100 * interval[1]:.0f})"


def score_text(name: str, value: float) -> str:
    """A metric's value with its unit."""
    return f"{score_number(name, value)}{_kind(name)[0]}"


def score_number(name: str, value: float) -> str:
    """A metric's value in its unit, without it."""
    _, factor, digits = _kind(name)
    return f"{factor * value:.{digits}f}"


def _kind(name: str) -> tuple[str, float, int]:
    """A metric's unit as it is written, what its value is multiplied by, and digits after the point."""
    shares = {"add_auc": ("", 1.0, 3)}
    ends = {"_cm": (" cm", 1.0, 2), "_deg": ("°", 1.0, 1), "_newton": (" N", 1.0, 1), "_ratio": ("", 1.0, 2)}
    return shares.get(name) or next((kind for end, kind in ends.items() if name.endswith(end)), (" %", 100.0, 1))


_REASONS = (
    "Never lifted: did not rise by half of what was demonstrated. Dropped: rose, but ended below half of the height. "
    "Rotated: in place, but turned. Late: in place up to 1 s too late. Strayed: held, but elsewhere."
)


def _columns(title: str, seeds: int) -> list[str]:
    return [title] if seeds == 1 else [f"{title}, mean of {seeds} seeds", "least to greatest"]


def _cells(name: str, values: Sequence[float | None], interval: tuple[float, float] | None) -> list[str]:
    given = [value for value in values if value is not None]
    if not given:
        return [""] * len(_columns("", len(values)))
    mean = float(np.mean(given))
    mean = share_text(mean, interval) if interval else score_text(name, mean)
    if len(values) == 1:
        return [mean]
    least, greatest = score_text(name, min(given)), score_text(name, max(given))
    return [mean, least if least == greatest else f"{score_number(name, min(given))} to {greatest}"]


def _outcome(evaluation: Evaluation, demonstration: int) -> str:
    (k,) = np.flatnonzero(evaluation.demonstration == demonstration)
    error, reason = f"{evaluation.scores['tracking_error_cm'][k]:.2f}", evaluation.failure[k]
    return f"{reason}, {error}" if reason else f"✓ {error}"
