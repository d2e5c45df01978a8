"""Evaluations on demonstrations of several grasp types or recordings, as a table: a row a type, a column a policy."""

from collections.abc import Mapping, Sequence

import numpy as np

from envs.evaluation.evaluate import Evaluation
from envs.grip_force import RECORDED
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.view.report import Table
from train.reports.published import PAPER

_SHOWN = ("manip_trans_object", "tracking_error_cm")


def groups(demonstrations: Sequence[Demonstration]) -> list[str]:
    """What each demonstration's scores are shown with: its grasp type, or the recording that it is of."""
    return [d.source if d.grasp == RECORDED else d.grasp for d in demonstrations]


def type_scores(evaluation: Evaluation, grasps: Sequence[str]) -> dict[str, dict[str, float]]:
    """Grasp type to the mean of every metric over its rollouts; the types as they first come.

    Args:
        evaluation: of demonstrations of one or several types.
        grasps: each demonstration's grasp type, by the numbers in `evaluation.demonstration`.

    Raises:
        InputError: a rollout of a demonstration whose type is not given, or a type without a rollout.
    """
    last = int(evaluation.demonstration.max())
    if last >= len(grasps):
        raise InputError(f"a rollout follows demonstration {last}, but {len(grasps)} types are given; give one each")
    followed = np.array(grasps)[evaluation.demonstration]
    return {grasp: evaluation.rows(followed == grasp) for grasp in dict.fromkeys(grasps)}


def type_table(evaluations: Mapping[str, Sequence[Evaluation]], grasps: Sequence[str], note: str = "") -> Table:
    """Success (ManipTrans object) and tracking error of every grasp type, and their means over the types.

    Args:
        evaluations: column title to its evaluations, one a seed; a cell is the mean over the seeds.
        grasps: each demonstration's grasp type.
        note: printed below the table.

    Raises:
        InputError: as `type_scores`.
    """
    types = list(dict.fromkeys(grasps))
    columns = {}
    for title, each in evaluations.items():
        scores = [type_scores(evaluation, grasps) for evaluation in each]
        columns[title] = [np.mean([[s[grasp][n] for n in _SHOWN] for s in scores], axis=0) for grasp in types]
    if all(grasp in PAPER for grasp in types):
        columns["paper, its own count"] = [[PAPER[g].success, PAPER[g].tracking_error_cm] for g in types]
    cells = [[_text(*row) for row in (*rows, np.mean(rows, axis=0))] for rows in columns.values()]
    return Table(("", *columns), list(zip([*types, "mean over the types"], *cells, strict=True)), note)


def _text(success: float, error: float) -> str:
    return f"{100 * success:.1f} %, {error:.2f} cm"
