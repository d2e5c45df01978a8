"""Intervals of shares: how far a count of rollouts may be from what more of them would show."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool
from scipy.stats import binomtest

from envs.evaluation.evaluate import Evaluation


def wilson(success: Bool[np.ndarray, "n"]) -> tuple[float, float]:
    """The 95 % interval of a share (Wilson 1927, https://doi.org/10.1080/01621459.1927.10502953)."""
    found = binomtest(int(success.sum()), len(success)).proportion_ci(method="wilson")
    return float(found.low), float(found.high)


def intervals(evaluations: Sequence[Evaluation]) -> dict[str, tuple[float, float]]:
    """Of every metric that is a success, over the rollouts of all evaluations together.

    Seeds share demonstrations, so that their rollouts are not independent: the interval is then a little too narrow.
    """
    names = [name for name, values in evaluations[0].scores.items() if values.dtype == bool]
    return {name: wilson(np.concatenate([e.scores[name] for e in evaluations])) for name in names}
