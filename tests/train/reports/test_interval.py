import numpy as np
import pytest

from envs.evaluation.evaluate import Evaluation
from train.reports.interval import intervals, wilson


@pytest.mark.parametrize(("good", "count"), [(0, 7), (31, 32), (32, 32), (150, 480)])
def test_the_interval_is_where_a_share_would_be_1_96_deviations_off(good, count):
    low, high = wilson(np.arange(count) < good)
    for share in {low, high} - {0.0, 1.0}:
        assert abs(good / count - share) == pytest.approx(1.95996 * np.sqrt(share * (1 - share) / count), rel=1e-4)


def test_shares_of_all_seeds_together_and_no_errors():
    seeds = [
        Evaluation(np.zeros(4, int), {"chord": np.array(good), "tracking_error_cm": np.ones(4)}, ("",) * 4)
        for good in ([True] * 4, [True, False, True, False])
    ]
    assert intervals(seeds) == {"chord": wilson(np.arange(8) < 6)}
