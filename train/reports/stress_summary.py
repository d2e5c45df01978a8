"""What all experiments' policies keep under disturbances, beside the constant press, in one table."""

from collections.abc import Sequence

import numpy as np

from mjx_hand.view.report import Table
from train.experiment.evaluate_seeds import POLICY, PRESS
from train.reports.results_table import Experiment

_NOTE = (
    "% of all rollouts that are never lost (CHORD) and still held 5 s later, policy / constant press; neither is told "
    "of the disturbance. The press is in each row the better of those that searches on the training demonstrations "
    "found, as recorded and disturbed as in training."
)


def stress_summary(experiments: Sequence[Experiment]) -> Table | None:
    """A row a disturbance, a column an experiment, and their mean; None where not all were tested for it."""
    rows = [experiment.stress["rows"] for experiment in experiments if experiment.stress]
    if not rows or len(rows) < len(experiments) or len({tuple(each) for each in rows}) > 1:
        return None

    def cells(disturbance: str) -> list[str]:
        kept = 100 * np.array([[each[disturbance][column]["kept"] for column in (POLICY, PRESS)] for each in rows])
        every = [*kept, kept.mean(axis=0)] if len(rows) > 1 else kept
        return [f"{policy:.1f} / {press:.1f}" for policy, press in every]

    mean = ("mean",) if len(rows) > 1 else ()
    columns = ("disturbance", *(experiment.name for experiment in experiments), *mean)
    return Table(columns, [(disturbance, *cells(disturbance)) for disturbance in rows[0]], _NOTE)
