"""What the constraint solver of MJX or MuJoCo Warp has to do: iterations, constraint rows and contacts of a step."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float
from mujoco import mjx

from envs.physics.engine import Engine, PhysicsState
from mjx_hand.errors import InputError


@dataclasses.dataclass(frozen=True)
class SolverLoad:
    """Means over worlds and physics steps, and the greatest number of rows that one world had.

    Attributes:
        iterations: of the solver; None where the engine does not tell (MJX counts them inside its loop and drops them).
        rows: constraint rows that act.
        contacts: that act.
        most_rows: the greatest number of rows of a world.
        room: rows that a world has room for, all of which MJX works out.
    """

    iterations: float | None
    rows: float
    contacts: float
    most_rows: float
    room: float


def solver_load(engine: Engine, start: PhysicsState, controls: Float[Array, "t n u"]) -> SolverLoad:
    """The load of worlds that follow these controls, each for the engine's substeps.

    Args:
        engine: `mjx` or `warp`.
        start: of n worlds.
        controls: what their actuators are told at each control step.

    Raises:
        InputError: the engine is neither of the two.
    """
    if engine.name not in ("mjx", "warp"):
        raise InputError(f"engine {engine.name!r} does not tell what its solver does; valid: mjx, warp")
    made: Any = engine
    blank = made._blank(len(start.variant)) if engine.name == "warp" else made._blank

    @jax.jit
    @jax.vmap
    def run(variant: Array, qpos: Array, qvel: Array, warmstart: Array, controls: Array) -> dict[str, Array]:
        model = made._family.model(variant)

        def step(data: mjx.Data, ctrl: Array) -> tuple[mjx.Data, dict[str, Array]]:
            data = mjx.step(model, data.replace(ctrl=ctrl))
            return data, step_load(data)

        placed = made.placed(blank, model) if engine.name == "warp" else blank
        data = placed.replace(qpos=qpos, qvel=qvel, qacc_warmstart=warmstart)
        return jax.lax.scan(step, data, jnp.repeat(controls, engine.substeps, axis=0))[1]

    return mean_load(run(start.variant, start.qpos, start.qvel, start.memory, jnp.swapaxes(controls, 0, 1)))


def step_load(data: mjx.Data) -> dict[str, Array]:
    """What the last step of one world had to solve, within `jax.vmap`."""
    told: Any = data._impl
    if hasattr(told, "nacon"):  # MuJoCo Warp; its contacts are counted over all worlds
        rows = told.nefc
        load = {"iterations": told.solver_niter, "room": jnp.array(told.njmax), "all_contacts": told.nacon[0]}
    else:  # MJX has room for every contact that may be; rows of those that do not act are zero
        rows = (told.efc_J != 0).any(axis=-1).sum()
        acting = (told.contact.dist < told.contact.includemargin).sum()
        load = {"room": jnp.array(told.efc_J.shape[0]), "contacts": acting}
    return {name: value.astype(jnp.float32) for name, value in {**load, "rows": rows, "most_rows": rows}.items()}


def over_steps(load: Mapping[str, Float[Array, "... t"]]) -> dict[str, Array]:
    """The load of several steps of each world, their last axis, as that of one."""
    return {name: value.max(-1) if name == "most_rows" else value.mean(-1) for name, value in load.items()}


def mean_load(loads: Mapping[str, Float[Array, "n ..."]]) -> SolverLoad:
    """The load over n worlds and their steps."""
    mean = {name: float(value.mean()) for name, value in loads.items()}
    return SolverLoad(
        iterations=mean.get("iterations"),
        rows=mean["rows"],
        contacts=mean["all_contacts"] / len(loads["rows"]) if "all_contacts" in mean else mean["contacts"],
        most_rows=float(loads["most_rows"].max()),
        room=mean["room"],
    )
