"""What a training's `curve.csv` tells: its evaluations, and how long it took to learn."""

import csv
import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mjx_hand.errors import InputError
from train.settings.config import Config

CURVE = "curve.csv"
LEARNED = 0.95  # share of training demonstrations from which a policy counts as having learned


@dataclasses.dataclass(frozen=True)
class Point:
    """One evaluation on the training demonstrations: steps and seconds so far, and scores."""

    steps: int
    seconds: float
    success: float
    tracking_error_cm: float
    rotation_error_deg: float


def load_curve(folder: str | Path) -> list[Point]:
    """The evaluations of the training in a folder, in order; none where it has not begun.

    Raises:
        InputError: the file is not one that a training wrote.
    """
    path = Path(folder) / CURVE
    if not path.is_file():
        return []
    names = [field.name for field in dataclasses.fields(Point)]
    try:
        with path.open() as file:
            rows = [{name: float(row[name]) for name in names} for row in csv.DictReader(file)]
        return [Point(**{**row, "steps": int(row["steps"])}) for row in rows]
    except (KeyError, TypeError, ValueError, OverflowError, csv.Error, OSError):
        raise InputError(
            f"{path}: not a learning curve; delete it and give the training's command again, which writes it anew"
        ) from None


def points_of(notes: Mapping[str, Any]) -> list[Point]:
    """The evaluations that a state's notes tell of."""
    return [Point(**point) for point in notes["points"]]


def is_finished(config: Config, points: Sequence[Point]) -> bool:
    """Whether a training with these evaluations has done all its steps, or reached what it may stop at."""
    if not points:
        return False
    return points[-1].steps >= config.ppo.timesteps or points[-1].success >= config.checks.stop_at


def minutes_to_learn(points: Sequence[Point], share: float = LEARNED) -> float | None:
    """Minutes of training until this share of the training demonstrations was first followed; None if never."""
    return next((point.seconds / 60 for point in points if point.success >= share), None)
