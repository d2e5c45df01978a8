import dataclasses
from typing import Any

import jax.numpy as jnp
import pytest

from envs.rewards import TERMS, RewardWeights, metric_names
from envs.task import Task
from mjx_hand.errors import InputError


@pytest.mark.parametrize("weight", [-0.1, float("nan"), float("inf")])
def test_weights_that_make_no_reward_are_refused(weight):
    with pytest.raises(InputError, match=rf"task.rewards.tips is {weight}; it must be 0 or more"):
        RewardWeights(tips=weight)


def test_a_term_is_one_function_with_its_default_weight():
    assert {name: (term.sign * term.weight) for name, term in TERMS.items()} == {
        **{"position": 1.0, "rotation": 1.0, "action": -0.002},
        **{"joints": 0.0, "tips": 0.0, "action_rate": 0.0, "grip_force": 0.0},
    }
    weights: Any = Task().rewards
    assert dataclasses.asdict(weights) == {name: term.weight for name, term in TERMS.items()}
    assert all(term.value.__name__ == name and term.value.__doc__ for name, term in TERMS.items())
    assert metric_names(RewardWeights(action=0.0, tips=1.0)) == (
        *("reward/position", "reward/rotation", "reward/action"),
        "reward/tips",
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"substeps": 0}, "task.substeps is 0; it must be a positive number"),
        ({"residual_scale_fingers": -0.1}, "task.residual_scale_fingers is -0.1"),
        ({"termination_distance": float("nan")}, "task.termination_distance is nan"),
        ({"termination_distance_last": 0.0}, "task.termination_distance_last is 0.0; it must be a positive number"),
        ({"termination_angle": 0.0}, "task.termination_angle is 0.0; it must be a positive number"),
        ({"wrap_torque": 1.5}, "task.wrap_torque is 1.5; it must lie between 0 and 1"),
        ({"assist": -1.0}, "task.assist is -1.0; it must lie between 0 and 600"),
        ({"assist": 1e4}, "more shakes the object"),
        ({"assist_until": 0.0}, "task.assist_until is 0.0; it must be a positive number"),
        ({"residual_scale_wrist_position": float("inf")}, "task.residual_scale_wrist_position is inf"),
        ({"smoothing": 1.0}, "would ignore every action"),
        ({"smoothing": 1.5}, "must lie between 0 and 1"),
        ({"random_start_prob": -0.1}, "task.random_start_prob is -0.1; it must lie between 0 and 1"),
        ({"grip_force": -1.0}, "task.grip_force is -1.0; it must not be negative"),
        ({"lookahead": ()}, "it must list frames ahead"),
        ({"lookahead": (0, 1)}, "each at least 1"),
    ],
)
def test_numbers_that_make_no_task_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        Task(**change)


def test_equal_tasks_are_one_key():
    assert {Task(lookahead=(1, 2)): "kept"}[dataclasses.replace(Task(), lookahead=(1, 2))] == "kept"


def test_termination_tightens_and_assistance_fades_with_the_training():
    task = Task(termination_distance=0.1, termination_distance_last=0.04, assist=300.0, assist_until=0.5)
    assert [float(task.lost_distance(jnp.float32(p))) for p in (0.0, 0.5, 1.0)] == pytest.approx([0.1, 0.07, 0.04])
    assert [float(task.assist_stiffness(jnp.float32(p))) for p in (0.0, 0.25, 0.5, 1.0)] == [300, 150, 0, 0]


@pytest.mark.parametrize(
    ("position", "rotation", "angle", "lost"),
    [(0.05, 0.4, 0.5, False), (0.09, 0.0, 0.5, True), (0.0, 0.6, 0.5, True), (0.0, 3.0, None, False)],
)
def test_what_is_far_or_turned_is_lost(position, rotation, angle, lost):
    task = Task(termination_distance=0.08, termination_angle=angle)
    assert bool(task.lost(jnp.float32(position), jnp.float32(rotation), jnp.float32(0.0))) == lost


def test_by_default_neither_changes():
    assert [float(Task().lost_distance(jnp.float32(p))) for p in (0.0, 1.0)] == pytest.approx([0.08, 0.08])
    assert float(Task().assist_stiffness(jnp.float32(0.0))) == 0
