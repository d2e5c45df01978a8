"""The reward: a sum of named terms, each a function of what a control step led to, times its weight.

The defaults are those of arXiv 2512.07359, exp(-alpha_p |p - p_ref|) + exp(-alpha_r angle) - 0.002 |a|^2. One more term
is one more function here, with its default weight: the option `task.rewards.NAME` and the metric `reward/NAME` follow.
"""

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_hand.errors import InputError


@dataclasses.dataclass(frozen=True)
class TrackedStep:
    """What a control step of one world led to, beside what the demonstration has at that frame.

    Attributes:
        position, rotation: the object's distance (m) and angle (rad) from its reference.
        position_alpha, rotation_alpha: the task's sharpness for them (1/m, 1/rad).
        hinges, hinges_reference: values of the hand's actuated joints (rad).
        tips, tips_reference: finger tips in the world (m), in the order of the hand's fingers.
        action: what the policy did, from -1 to 1.
        change: of the filtered action, residual over its scale, since the step before.
        forces: what each link presses the object with (N, world).
        least_force: the least sum of their magnitudes (N) that carries the object by upright faces.
    """

    position: Float[Array, ""]
    rotation: Float[Array, ""]
    position_alpha: float
    rotation_alpha: float
    hinges: Float[Array, "j"]
    hinges_reference: Float[Array, "j"]
    tips: Float[Array, "tips 3"]
    tips_reference: Float[Array, "tips 3"]
    action: Float[Array, "u"]
    change: Float[Array, "u"]
    forces: Float[Array, "links 3"]
    least_force: Float[Array, ""]


Value = Callable[[TrackedStep], Float[Array, ""]]


@dataclasses.dataclass(frozen=True)
class Term:
    """One term: its default weight, the sign that it counts with, and its value."""

    weight: float
    sign: float
    value: Value


TERMS: dict[str, Term] = {}


def reward(weight: float) -> Callable[[Value], Value]:
    """Register a function as a term that is earned, by its name."""
    return lambda value: _registered(value, Term(weight, 1.0, value))


def cost(weight: float) -> Callable[[Value], Value]:
    """Register a function as a term that is paid, by its name."""
    return lambda value: _registered(value, Term(weight, -1.0, value))


def _registered(value: Value, term: Term) -> Value:
    TERMS[value.__name__] = term
    return value


@reward(1.0)
def position(step: TrackedStep) -> Float[Array, ""]:
    """exp(-alpha_p d) of the object's distance."""
    return jnp.exp(-step.position_alpha * step.position)


@reward(1.0)
def rotation(step: TrackedStep) -> Float[Array, ""]:
    """exp(-alpha_r angle) of the object's rotation."""
    return jnp.exp(-step.rotation_alpha * step.rotation)


@cost(0.002)
def action(step: TrackedStep) -> Float[Array, ""]:
    """|a|^2 of the action."""
    return jnp.sum(step.action**2)


@reward(0.0)
def joints(step: TrackedStep) -> Float[Array, ""]:
    """exp(-5 e) of the hinges' mean distance e (rad) from the demonstration."""
    return jnp.exp(-5.0 * jnp.mean(jnp.abs(step.hinges - step.hinges_reference)))


@reward(0.0)
def tips(step: TrackedStep) -> Float[Array, ""]:
    """exp(-30 d) of the finger tips' mean distance d (m) from the demonstration."""
    return jnp.exp(-30.0 * jnp.mean(jnp.linalg.norm(step.tips - step.tips_reference, axis=-1)))


@cost(0.0)
def action_rate(step: TrackedStep) -> Float[Array, ""]:
    """|c|^2 of the filtered action's change c in a step, so that what is commanded is smooth."""
    return jnp.sum(step.change**2)


@cost(0.0)
def grip_force(step: TrackedStep) -> Float[Array, ""]:
    """By how much the links' forces on the object exceed what its weight needs, over that."""
    total = jnp.sum(jnp.sqrt(jnp.sum(step.forces**2, axis=-1) + 1e-9))  # N^2, where the magnitude has no derivative
    return jnp.maximum(total / step.least_force - 1.0, 0.0)


def _check_weights(weights: "RewardWeights") -> None:
    for name in TERMS:
        value = getattr(weights, name)
        if not (math.isfinite(value) and value >= 0):
            raise InputError(f"task.rewards.{name} is {value}; it must be 0 or more (costs are subtracted anyway)")


if TYPE_CHECKING:

    @dataclasses.dataclass(frozen=True, init=False)
    class RewardWeights:
        """The weight of each of `TERMS`; 0 leaves a term out."""

        def __init__(self, **weights: float): ...

else:
    RewardWeights = dataclasses.make_dataclass(
        "RewardWeights",
        [(name, float, term.weight) for name, term in TERMS.items()],
        namespace={
            "__doc__": "The weight of each of `TERMS`; 0 leaves a term out.",
            "__module__": __name__,  # where processes of a sweep find it
            "__post_init__": _check_weights,
        },
        frozen=True,
    )


def metric_names(weights: RewardWeights) -> tuple[str, ...]:
    """The names that `weighted_terms` gives."""
    return tuple(f"reward/{name}" for name in _counted(weights))


def weighted_terms(weights: RewardWeights, step: TrackedStep) -> dict[str, Float[Array, ""]]:
    """The summands of the reward, by `reward/NAME`."""
    terms = {name: TERMS[name] for name in _counted(weights)}
    return {f"reward/{name}": t.sign * getattr(weights, name) * t.value(step) for name, t in terms.items()}


def _counted(weights: RewardWeights) -> list[str]:
    # Default terms stay when their weight is 0, so that their metrics do: a training's state keeps its shape.
    return [name for name, term in TERMS.items() if term.weight or getattr(weights, name)]
