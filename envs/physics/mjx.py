"""The `mjx` engine: MuJoCo's physics in JAX, on any accelerator."""

import copy
import dataclasses
from collections.abc import Sequence
from typing import Any

import jax
import mujoco
import numpy as np
from jaxtyping import Array, Float, Int
from mujoco import mjx

from envs.physics.engine import PhysicsState
from envs.physics.family import make_family
from envs.physics.recovery import recovered
from envs.physics.solver import newton
from mjx_hand.errors import InputError


def make(models: Sequence[mujoco.MjModel], substeps: int) -> "MjxEngine":
    """The engine over copies of the models with the settings of MuJoCo's C engine.

    Pyramidal cones with fewer iterations (impratio 3, 6 and 8) are four times as quick and another physics: the same
    replays from mid-grasp hold 11 of 64 objects, not 56. Elliptic ones with 6 and 8 throw them metres away.

    Raises:
        InputError: contacts without friction, which MJX has not with elliptic cones.
    """
    if any((model.pair_dim == 1).any() for model in models):
        raise InputError(
            "engine 'mjx' cannot let the hand meet itself (task.contacts=self or all): it has no contacts without "
            "friction; use engine 'native' or 'warp', or task.contacts=ground"
        )
    return MjxEngine(newton(models), substeps)


class MjxEngine:
    """See `envs.physics.engine.Engine`."""

    name = "mjx"

    def __init__(self, models: Sequence[mujoco.MjModel], substeps: int):
        self.models = list(models)
        self.substeps = substeps
        self._family = make_family([_put(model, self.models[0]) for model in self.models])
        self._blank = mjx.make_data(self.models[0], impl="jax")

    @property
    def tables(self) -> Any:
        return self._family.leaves

    def with_tables(self, tables: Any) -> "MjxEngine":
        other = copy.copy(self)
        other._family = dataclasses.replace(self._family, leaves=tables)
        return other

    def reset(
        self, variant: Int[Array, ""], qpos: Float[Array, "nq"], qvel: Float[Array, "nv"], ctrl: Float[Array, "nu"]
    ) -> PhysicsState:
        return self._state(variant, self._blank.replace(qpos=qpos, qvel=qvel, ctrl=ctrl))

    def step(self, state: PhysicsState, ctrl: Float[Array, "nu"]) -> PhysicsState:
        model = self._family.model(state.variant)
        data = self._blank.replace(qpos=state.qpos, qvel=state.qvel, qacc_warmstart=state.memory, ctrl=ctrl)
        data, _ = jax.lax.scan(lambda d, _: (mjx.step(model, d), None), data, length=self.substeps)
        return self._state(state.variant, data)

    def _state(self, variant: Int[Array, ""], data: mjx.Data) -> PhysicsState:
        model = self._family.model(variant)
        qpos, qvel, warmstart, unstable = recovered(model.qpos0, data.qpos, data.qvel, data.qacc_warmstart)
        # MJX leaves positions that derive from the state a substep behind it.
        data = mjx.kinematics(model, data.replace(qpos=qpos, qvel=qvel))
        data = mjx.sensor_pos(model, mjx.com_pos(model, data))
        return PhysicsState(
            variant=variant,
            qpos=data.qpos,
            qvel=data.qvel,
            sensordata=data.sensordata,
            memory=warmstart,
            unstable=unstable,
        )


def _put(model: mujoco.MjModel, first: mujoco.MjModel) -> mjx.Model:
    if model.nhfield:
        raise InputError("engine 'mjx' runs no height fields in families of models; use engine 'native'")
    put = mjx.put_model(model, impl="jax")
    # Compiled in, and different from hand to hand, but read for height fields alone.
    return put.replace(_impl=put._impl.replace(geom_rbound_hfield=np.array(first.geom_rbound)))
