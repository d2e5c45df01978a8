import numpy as np
import pytest

from envs.evaluation import Evaluation, evaluate
from envs.published import PAPER
from envs.score_table import TITLES, failure_table, score_table
from mjx_hand.errors import InputError
from tests.envs.test_metrics import CUBE, lift


def evaluation(success: list[bool], **scores: list[float]) -> Evaluation:
    return Evaluation(
        demonstration=np.zeros(len(success), int),
        scores={
            "manip_trans_object": np.array(success),
            "tracking_error_cm": np.where(success, 0.5, 8.0),
            **{name: np.array(values) for name, values in scores.items()},
        },
        failure=tuple("" if good else "dropped" for good in success),
    )


def test_a_row_a_metric_and_a_column_a_policy():
    policy = evaluation([True, True, True, False], add_auc=[1.0, 1.0, 1.0, 0.25])
    baseline = evaluation([False] * 4, hold=[0.0, 1.0, 0.0, 0.0])
    table = score_table({"policy": policy, "zero residual": baseline}, PAPER["pinch"])
    assert table.columns == ("", "policy", "zero residual", "paper")
    assert table.rows == [
        ("success, by the paper's own count", "", "", "82.3 %"),
        (TITLES["manip_trans_object"], "75.0 %", "0.0 %", ""),
        (TITLES["hold"], "", "25.0 %", ""),
        (TITLES["add_auc"], "0.812", "", ""),
        (TITLES["tracking_error_cm"], "2.38 cm", "8.00 cm", "0.95 cm"),
    ]


def test_without_the_paper_there_is_no_column_for_it():
    table = score_table({"policy": evaluation([True])})
    assert table.columns == ("", "policy")
    assert [len(row) for row in table.rows] == [2, 2]


def test_failures_are_shares_of_all_rollouts():
    table = failure_table({"policy": evaluation([True, False, True, True])})
    assert ("dropped", "25.0 %") in table.rows
    assert ("late", "0.0 %") in table.rows


def test_nothing_to_show_is_refused():
    with pytest.raises(InputError, match="at least one column"):
        score_table({})


def test_every_metric_has_a_row():
    scores = evaluate(lift(held=250), [CUBE])
    assert set(scores.scores) == set(TITLES)
    assert len(score_table({"policy": scores}).rows) == len(TITLES)
