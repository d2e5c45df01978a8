import dataclasses

import pytest

from envs.task import Task
from mjx_hand.errors import InputError


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"substeps": 0}, "task.substeps is 0; it must be a positive number"),
        ({"finger": -0.1}, "task.finger is -0.1"),
        ({"lost_at": float("nan")}, "task.lost_at is nan"),
        ({"wrist_move": float("inf")}, "task.wrist_move is inf"),
        ({"smoothing": 1.0}, "would ignore every action"),
        ({"smoothing": 1.5}, "must lie between 0 and 1"),
        ({"mid_start": -0.1}, "task.mid_start is -0.1; it must lie between 0 and 1"),
        ({"action_cost": float("nan")}, "task.action_cost is nan; it must not be negative"),
        ({"grip_force": -1.0}, "task.grip_force is -1.0; it must not be negative"),
        ({"ahead": ()}, "it must list frames ahead"),
        ({"ahead": (0, 1)}, "each at least 1"),
    ],
)
def test_numbers_that_make_no_task_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        Task(**change)


def test_equal_tasks_are_one_key():
    assert {Task(ahead=(1, 2)): "kept"}[dataclasses.replace(Task(), ahead=(1, 2))] == "kept"
