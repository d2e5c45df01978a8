"""`Twin` and `Tables`: the state of a world in which a hand tracks a demonstration, and what such worlds look up."""

from typing import Any, cast

from brax.envs.base import State
from jaxtyping import Array, Float, Int

from envs.disturbances.episode import Episode
from envs.disturbances.tables import DisturbanceTables
from envs.physics.engine import PhysicsState
from envs.reference import Reference
from mjx_hand.pytree import pytree


@pytree
class Twin:
    """A world's state: physics, which demonstration it follows, how far it is, the residual so far, disturbances.

    `episode` is None in an environment without disturbances, `commanded`, what a teleoperated hand was told last
    without its residual (m, rad), in one of other hands.
    """

    physics: PhysicsState
    demonstration: Int[Array, "*b"]
    frame: Int[Array, "*b"]
    residual: Float[Array, "*b u"]
    episode: Episode | None = None
    commanded: Float[Array, "*b u"] | None = None


@pytree
class Tables:
    """What an environment looks up: arrays that a compiled function can be given as an argument.

    What was compiled over `env.with_tables(argument)` runs any other set of equally many, equally long demonstrations.

    Attributes:
        reference: the demonstrations and their controls.
        starts: the engine's state at every frame of every demonstration.
        least_force: least sum of contact forces (N) that carries the object, of each of the engine's scenes.
        inertia: mass (kg) and mean moment of inertia (kg m2) of each demonstration's object.
        low, high: limits of the targets (m, rad).
        engine: the engine's own (`Engine.tables`).
        disturbances: of an environment that has them.
    """

    reference: Reference
    starts: PhysicsState
    least_force: Float[Array, "v"]
    inertia: Float[Array, "d 2"]
    low: Float[Array, "u"]
    high: Float[Array, "u"]
    engine: Any
    disturbances: DisturbanceTables | None = None


def twin_of(state: State) -> Twin:
    """What a state of `TrackingEnv` carries; Brax's own type for it is that of its physics."""
    return cast(Twin, state.pipeline_state)
