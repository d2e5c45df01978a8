import numpy as np
import pytest

from envs.evaluation.evaluate import Evaluation
from envs.grasps import FIVE
from mjx_hand.errors import InputError
from train.reports.published import PAPER
from train.reports.type_table import type_scores, type_table


def evaluation(followed: list[int], success: list[bool], error: list[float]) -> Evaluation:
    return Evaluation(
        demonstration=np.array(followed),
        scores={"manip_trans_object": np.array(success), "tracking_error_cm": np.array(error)},
        failure=tuple("" if good else "dropped" for good in success),
    )


GRASPS = ["power", "power", "cylindrical"]


def test_every_rollout_counts_for_its_own_type():
    mixed = evaluation([2, 0, 1, 1], [True, True, False, False], [0.5, 1.0, 2.0, 6.0])
    scores = type_scores(mixed, GRASPS)
    assert list(scores) == ["power", "cylindrical"]
    assert scores["power"] == pytest.approx({"manip_trans_object": 1 / 3, "tracking_error_cm": 3.0})
    assert scores["cylindrical"] == pytest.approx({"manip_trans_object": 1.0, "tracking_error_cm": 0.5})


def test_the_mean_is_over_types_however_many_demonstrations_each_has():
    seeds = [
        evaluation([0, 1, 2], [True, True, False], [0.4, 0.6, 4.0]),
        evaluation([0, 1, 2], [True, False, False], [0.4, 1.6, 6.0]),
    ]
    zero = evaluation([0, 1, 2], [False] * 3, [8.0, 8.0, 8.0])
    table = type_table({"policy": seeds, "zero residual": [zero]}, GRASPS, "a note")
    assert table.columns == ("", "policy", "zero residual", "paper, its own count")
    assert table.rows == [
        ("power", "75.0 %, 0.75 cm", "0.0 %, 8.00 cm", "73.0 %, 0.83 cm"),
        ("cylindrical", "0.0 %, 5.00 cm", "0.0 %, 8.00 cm", "72.2 %, 0.87 cm"),
        ("mean over the types", "37.5 %, 2.88 cm", "0.0 %, 8.00 cm", "72.6 %, 0.85 cm"),
    ]
    assert table.note == "a note"


def test_the_papers_mean_over_all_types_is_what_it_says():
    every = evaluation(list(range(5)), [True] * 5, [0.5] * 5)
    *_, mean = type_table({"policy": [every]}, FIVE).rows
    assert mean[1:] == (
        "100.0 %, 0.50 cm",
        f"{100 * PAPER['all'].success:.1f} %, {PAPER['all'].tracking_error_cm} cm",
    )


def test_types_that_the_paper_lacks_have_no_column_of_it():
    table = type_table({"policy": [evaluation([0], [True], [0.5])]}, ["wave"])
    assert table.columns == ("", "policy")


def test_a_type_must_be_given_for_every_demonstration_and_have_a_rollout():
    with pytest.raises(InputError, match="follows demonstration 2, but 1 types are given"):
        type_scores(evaluation([2], [True], [0.5]), ["pinch"])
    with pytest.raises(InputError, match="no rollout is selected"):
        type_scores(evaluation([0], [True], [0.5]), ["pinch", "power"])
