import numpy as np
import pytest

from envs.evaluation.evaluate import Evaluation, evaluate
from mjx_hand.errors import InputError
from mjx_hand.objects.description import ObjectDescription
from tests.envs.lifts import CUBE, lift
from train.reports.published import PAPER
from train.reports.score_table import TITLES, demonstration_table, failed_table, failure_table, object_text, score_table


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
    baseline = evaluation([False] * 4, kept=[False, True, False, False])
    table = score_table({"policy": [policy], "zero residual": [baseline]}, PAPER["pinch"])
    assert table.columns == ("", "policy", "zero residual", "paper")
    assert table.rows == [
        ("success, by the paper's own count", "", "", "82.3 %"),
        (TITLES["kept"], "", "25.0 % (5 to 70)", ""),
        (TITLES["manip_trans_object"], "75.0 % (30 to 95)", "0.0 % (0 to 49)", ""),
        (TITLES["add_auc"], "0.812", "", ""),
        (TITLES["tracking_error_cm"], "2.38 cm", "8.00 cm", "0.95 cm"),
    ]


def test_without_the_paper_there_is_no_column_for_it():
    table = score_table({"policy": [evaluation([True])]})
    assert table.columns == ("", "policy")
    assert [len(row) for row in table.rows] == [2, 2]


def test_failures_are_shares_of_all_rollouts():
    table = failure_table({"policy": [evaluation([True, False, True, True])]})
    assert ("dropped", "25.0 %") in table.rows
    assert ("late", "0.0 %") in table.rows


def test_several_seeds_have_their_mean_and_their_range():
    seeds = [evaluation([True, True]), evaluation([True, False]), evaluation([True, True])]
    table = score_table({"policy": seeds, "zero residual": [evaluation([False] * 2)]}, PAPER["pinch"])
    assert table.columns == ("", "policy, mean of 3 seeds", "least to greatest", "zero residual", "paper")
    shown = {row[0]: row[1:] for row in table.rows}
    assert shown[TITLES["manip_trans_object"]] == ("83.3 % (44 to 97)", "50.0 to 100.0 %", "0.0 % (0 to 66)", "")
    assert shown[TITLES["tracking_error_cm"]] == ("1.75 cm", "0.50 to 4.25 cm", "8.00 cm", "0.95 cm")
    assert ("dropped", "16.7 %") in failure_table({"policy": seeds}).rows


def numbered(success: list[bool], order: list[int]) -> Evaluation:
    errors = {"tracking_error_cm": np.where(success, 0.5, 8.0), "object_rotation_error_deg": np.full(len(order), 3.0)}
    return Evaluation(np.array(order), errors, tuple("" if good else "late" for good in success))


def test_a_row_a_demonstration_finds_its_own_rollout():
    ball = ObjectDescription(size=np.array([0.03, 0.0, 0.0]), mass=0.05, friction=1.0, kind="sphere")
    policies = {4: numbered([True, False], [1, 0]), 6: numbered([True, True], [0, 1])}
    table = demonstration_table(policies, {"zero residual": numbered([False, False], [0, 1])}, [CUBE, ball])
    assert table.columns == ("demonstration", "seed 4", "seed 6", "zero residual")
    assert [row[1:] for row in table.rows] == [
        ("late, 8.00", "✓ 0.50", "late, 8.00"),
        ("✓ 0.50", "✓ 0.50", "late, 8.00"),
    ]
    assert table.rows[1][0] == "1: sphere ⌀ 60 mm, 50 g, friction 1.00"


def test_every_failure_is_listed_with_its_reason():
    table = failed_table({4: numbered([True, False], [1, 0]), 6: numbered([True, True], [0, 1])})
    assert table.rows == [("demonstration 0", "seed 4", "late", "8.00 cm", "3.0°")]


@pytest.mark.parametrize(
    ("kind", "size", "said"),
    [
        ("box", (0.02, 0.02, 0.01), "box 40 × 40 × 20 mm"),
        ("cylinder", (0.03, 0.08, 0.0), "cylinder ⌀ 60 × 160 mm"),
        ("capsule", (0.01, 0.05, 0.0), "capsule ⌀ 20 × 120 mm"),
        ("mesh", (0.05, 0.03, 0.1), "mesh 100 × 60 × 200 mm"),
    ],
)
def test_objects_are_told_by_their_outer_measures(kind, size, said):
    description = ObjectDescription(size=np.array(size), mass=0.1, friction=0.8, kind=kind)
    assert object_text(description) == f"{said}, 100 g, friction 0.80"


def test_nothing_to_show_is_refused():
    with pytest.raises(InputError, match="at least one column"):
        score_table({})


def test_every_metric_has_a_row():
    scores = evaluate(lift(held=250), [CUBE])
    assert set(scores.scores) == set(TITLES)
    assert len(score_table({"policy": [scores]}).rows) == len(TITLES)
