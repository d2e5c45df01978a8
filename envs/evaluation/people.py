"""Who performed the demonstrations that rollouts follow, and how scores spread over these people."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from envs.evaluation.evaluate import Evaluation
from mjx_hand.motion.demonstration import Demonstration

_PERSON = re.compile(r"person (\d+)")  # as the source of simulated captures has it


def people_of(demonstrations: Sequence[Demonstration]) -> list[str]:
    """Of each demonstration who performed it, grasp type and number; "" where its source does not say."""
    found = [_PERSON.search(demonstration.source) for demonstration in demonstrations]
    return [f"{d.grasp} {match[1]}" if match else "" for d, match in zip(demonstrations, found, strict=True)]


def person_scores(evaluations: Sequence[Evaluation], people: Sequence[str]) -> Mapping[str, Mapping[str, float]]:
    """Person to the mean of every metric over all rollouts of theirs; nobody where any demonstration tells no person.

    Args:
        evaluations: one a seed.
        people: who performed each demonstration, by the numbers in `Evaluation.demonstration`.
    """
    if not all(people):
        return {}
    told: dict[str, Mapping[str, float]] = {}
    for person in dict.fromkeys(people):
        rows = [e.rows(np.array([people[k] == person for k in e.demonstration])) for e in evaluations]
        told[person] = {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}
    return told
