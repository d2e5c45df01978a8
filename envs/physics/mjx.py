"""The `mjx` engine: MuJoCo's physics in JAX, on any accelerator."""

import copy
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float, Int
from mujoco import mjx

from envs.physics.engine import PhysicsState
from mjx_hand.errors import InputError


def make(models: Sequence[mujoco.MjModel], substeps: int) -> "MjxEngine":
    """The engine with the settings that held best for it: few iterations, no early exit under vmap."""
    tuned = [copy.copy(model) for model in models]
    for model in tuned:
        model.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
        model.opt.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
        model.opt.impratio = 3.0
        model.opt.iterations = 6
        model.opt.ls_iterations = 8
    return MjxEngine(tuned, substeps, name="mjx", impl="jax", capacity={})


class MjxEngine:
    """See `envs.physics.engine.Engine`; `impl` chooses MJX's implementation, `capacity` its buffer sizes."""

    def __init__(
        self, models: Sequence[mujoco.MjModel], substeps: int, name: str, impl: str, capacity: dict[str, int]
    ):
        self.name = name
        self.models = list(models)
        self.substeps = substeps
        self._shared, self._varying = split_family([mjx.put_model(m, impl=impl) for m in self.models])
        self._blank = mjx.make_data(self.models[0], impl=impl, **capacity)

    def reset(
        self, variant: Int[Array, ""], qpos: Float[Array, "nq"], qvel: Float[Array, "nv"], ctrl: Float[Array, "nu"]
    ) -> PhysicsState:
        return self._state(variant, self._blank.replace(qpos=qpos, qvel=qvel, ctrl=ctrl))

    def step(self, state: PhysicsState, ctrl: Float[Array, "nu"]) -> PhysicsState:
        data = self._blank.replace(
            qpos=state.qpos, qvel=state.qvel, qacc_warmstart=state.memory["qacc_warmstart"], ctrl=ctrl
        )
        model = self._model(state.variant)
        data, _ = jax.lax.scan(lambda d, _: (mjx.step(model, d), None), data, length=self.substeps)
        return self._state(state.variant, data)

    def _model(self, variant: Int[Array, ""]) -> mjx.Model:
        leaves, structure = self._shared
        mine = list(leaves)
        for index, stacked in self._varying.items():
            mine[index] = stacked[variant]
        return jax.tree_util.tree_unflatten(structure, mine)

    def _state(self, variant: Int[Array, ""], data: mjx.Data) -> PhysicsState:
        # MJX leaves derived positions a substep behind, and does not reset a diverged simulation: do both here.
        unstable = ~(jnp.isfinite(data.qpos).all() & jnp.isfinite(data.qvel).all() & (jnp.abs(data.qvel) < 1e4).all())
        rest = jnp.asarray(self.models[0].qpos0, data.qpos.dtype)
        data = data.replace(
            qpos=jnp.where(unstable, rest, data.qpos),
            qvel=jnp.where(unstable, 0.0, data.qvel),
            qacc_warmstart=jnp.where(unstable, 0.0, data.qacc_warmstart),
        )
        model = self._model(variant)
        data = mjx.sensor_pos(model, mjx.com_pos(model, mjx.kinematics(model, data)))
        return PhysicsState(
            variant=variant,
            qpos=data.qpos,
            qvel=data.qvel,
            sensordata=data.sensordata,
            memory={"qacc_warmstart": data.qacc_warmstart},
            unstable=unstable.astype(jnp.float32),
        )


def split_family(models: Sequence[Any]) -> tuple[tuple[list[Any], Any], dict[int, Array]]:
    """The leaves and structure of the first model, and those leaves that differ between models, stacked.

    Stacking only what differs keeps a family of a hundred hands about as small as one.
    """
    structures = [jax.tree_util.tree_structure(m) for m in models]
    if any(s != structures[0] for s in structures):
        raise InputError("the models of a family differ in structure (geom types, joint types or sizes), not only size")
    rows = [jax.tree_util.tree_leaves(m) for m in models]
    varying = {
        i: jnp.stack([row[i] for row in rows])
        for i in range(len(rows[0]))
        if any(not np.array_equal(np.asarray(row[i]), np.asarray(rows[0][i])) for row in rows[1:])
    }
    return (rows[0], structures[0]), varying
