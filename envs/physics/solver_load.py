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

_Carry = tuple[Array, Array, Array]


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

    def one(
        variant: Array, qpos: Array, qvel: Array, warmstart: Array, ctrl: Array
    ) -> tuple[Array, Array, Array, dict[str, Array]]:
        data = blank.replace(qpos=qpos, qvel=qvel, qacc_warmstart=warmstart, ctrl=ctrl)
        data = mjx.step(made._family.model(variant), data)
        return data.qpos, data.qvel, data.qacc_warmstart, step_load(data)

    def step(carry: _Carry, ctrl: Array) -> tuple[_Carry, Mapping[str, Array]]:
        qpos, qvel, warmstart, load = jax.vmap(one)(start.variant, *carry, ctrl)
        return (qpos, qvel, warmstart), over_worlds(load)

    @jax.jit
    def run(carry: _Carry, controls: Array) -> Mapping[str, Array]:
        return jax.lax.scan(step, carry, jnp.repeat(controls, engine.substeps, axis=0))[1]

    return mean_load(run((start.qpos, start.qvel, start.memory), controls))


def step_load(data: mjx.Data) -> dict[str, Array]:
    """What the last step of one world had to solve, within `jax.vmap`."""
    told: Any = data._impl
    if hasattr(told, "nacon"):  # MuJoCo Warp; its contacts are counted over all worlds
        return {
            "iterations": told.solver_niter,
            "rows": told.nefc,
            "room": jnp.array(told.njmax),
            "all_contacts": told.nacon[0],
        }
    # MJX has room for every contact that may be; rows of those that do not act are zero.
    return {
        "rows": (told.efc_J != 0).any(axis=-1).sum(),
        "room": jnp.array(told.efc_J.shape[0]),
        "contacts": (told.contact.dist < told.contact.includemargin).sum(),
    }


def over_worlds(load: Mapping[str, Float[Array, "n"]]) -> dict[str, Array]:
    """Means over the worlds of what `step_load` tells of each, and the most rows."""
    means = {name: value.astype(jnp.float32).mean() for name, value in load.items() if name != "all_contacts"}
    if "all_contacts" in load:
        means["contacts"] = load["all_contacts"][0] / len(load["all_contacts"])
    return {**means, "most_rows": load["rows"].max().astype(jnp.float32)}


def mean_load(steps: Mapping[str, Float[Array, "t"]]) -> SolverLoad:
    """The load over steps, of each of which `over_worlds` tells."""
    return SolverLoad(
        iterations=float(steps["iterations"].mean()) if "iterations" in steps else None,
        rows=float(steps["rows"].mean()),
        contacts=float(steps["contacts"].mean()),
        most_rows=float(steps["most_rows"].max()),
        room=float(steps["room"].max()),
    )
