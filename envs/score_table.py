"""Evaluations as tables for reports: a row a metric, a column a policy, and the paper's figures beside them."""

from collections.abc import Mapping

from envs.evaluation import Evaluation
from envs.failure import FAILURES
from envs.published import Published
from mjx_hand.errors import InputError
from mjx_hand.view.report import Table

TITLES = {
    "manip_trans_object": "ManipTrans, object: means below 3 cm and 30°",
    "manip_trans_full": "ManipTrans: also joints below 8 cm, tips below 6 cm",
    "spider": "SPIDER: means below 10 cm and 0.5 rad",
    "chord": "CHORD: never past 10 cm, 0.5 rad, wrist 15 cm",
    "hold": "still held 5 s later, slip below 2 cm",
    "add_auc": "ADD-AUC, 1 to 9 cm",
    "tracking_error_cm": "tracking error, mean over all rollouts",
    "object_rotation_error_deg": "object rotation error",
    "joint_error_cm": "joint position error",
    "tip_error_cm": "finger tip position error",
}


def score_table(evaluations: Mapping[str, Evaluation], paper: Published | None = None, note: str = "") -> Table:
    """Every metric of every evaluation, and the paper's column where it is given.

    Args:
        evaluations: column title to evaluation.
        paper: the paper's row for the same grasp type; its success, which it does not define, gets a row of its own.
        note: printed below the table.

    Raises:
        InputError: no evaluations.
    """
    if not evaluations:
        raise InputError("no evaluations to show; give at least one column")
    means = {title: evaluation.rows() for title, evaluation in evaluations.items()}
    rows = []
    for name, title in TITLES.items():
        cells = [_text(name, row[name]) if name in row else "" for row in means.values()]
        published = [_text(name, paper.tracking_error_cm) if name == "tracking_error_cm" else ""] if paper else []
        if any(cells):
            rows.append((title, *cells, *published))
    if paper:
        rows.insert(0, ("success, by the paper's own count", *[""] * len(means), f"{100 * paper.success:.1f} %"))
    return Table(("", *means, *(["paper"] if paper else [])), rows, note)


def failure_table(evaluations: Mapping[str, Evaluation], note: str = "") -> Table:
    """How rollouts failed ManipTrans' object criterion, as shares of all rollouts."""
    shares = [evaluation.failure_shares() for evaluation in evaluations.values()]
    rows = [(reason, *(f"{100 * share[reason]:.1f} %" for share in shares)) for reason in FAILURES]
    return Table(("", *evaluations), rows, note)


def _text(name: str, value: float) -> str:
    if name.endswith("_cm"):
        return f"{value:.2f} cm"
    if name.endswith("_deg"):
        return f"{value:.1f}°"
    return f"{value:.3f}" if name == "add_auc" else f"{100 * value:.1f} %"
