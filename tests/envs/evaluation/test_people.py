import numpy as np
import pytest

from envs.evaluation.evaluate import Evaluation
from envs.evaluation.people import people_of, person_scores
from mjx_hand.pytree import replace
from train.reports.people_table import people_table


def test_simulated_captures_say_who_performed_them(demonstrations):
    given = [
        replace(demonstrations[0], source=f"simulated pinch, person {k}, seed 3.{j}") for k in (0, 11) for j in (0, 1)
    ]
    assert people_of([*given, replace(demonstrations[0], source="a recording")]) == [
        *["pinch 0"] * 2,
        *["pinch 11"] * 2,
        "",
    ]
    assert all(people_of(demonstrations)), "as the project makes them"


def scored(kept: list[bool], order: list[int]) -> Evaluation:
    scores = {"kept": np.array(kept), "tracking_error_cm": np.arange(1.0, 5.0)}
    return Evaluation(np.array(order), scores, ("",) * 4)


def test_a_person_has_the_mean_of_all_seeds_and_demonstrations():
    people = ["pinch 0", "pinch 1", "pinch 0", "pinch 1"]
    seeds = [scored([True, True, False, True], [0, 1, 2, 3]), scored([True, False, True, True], [3, 2, 1, 0])]
    found = person_scores(seeds, people)
    assert found["pinch 0"] == {"kept": 0.5, "tracking_error_cm": pytest.approx((1 + 3 + 2 + 4) / 4)}
    assert found["pinch 1"] == {"kept": 1.0, "tracking_error_cm": pytest.approx((2 + 4 + 1 + 3) / 4)}
    assert person_scores(seeds, [*people[:3], ""]) == {}
    assert [row[:2] for row in people_table(found).rows] == [("pinch 0", "50.0 %"), ("pinch 1", "100.0 %")]
