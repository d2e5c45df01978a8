"""The `mjx` engine: MuJoCo's physics in JAX, on any accelerator."""

import copy
import dataclasses
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float, Int
from mujoco import mjx

from envs.physics.engine import PhysicsState
from envs.physics.family import make_family
from envs.physics.recovery import recovered
from envs.physics.solver import newton
from mjx_hand.errors import InputError
from mjx_hand.player.contact_force import position_columns, sensed_bodies, stop_contact_sensors

_LITTLE = 0.001  # friction of pairs that slide on the other engines; with 0.1 grips part as far from the C engine's


def make(models: Sequence[mujoco.MjModel], substeps: int) -> "MjxEngine":
    """The engine over copies of the models with the settings of MuJoCo's C engine.

    Pyramidal cones with fewer iterations (impratio 3, 6 and 8) are four times as quick and another physics: the same
    replays from mid-grasp hold 11 of 64 objects, not 56. Elliptic ones with 6 and 8 throw them metres away.
    """
    return MjxEngine(_with_friction(newton(models)), substeps)


class MjxEngine:
    """See `envs.physics.engine.Engine`."""

    name = "mjx"

    def __init__(self, models: Sequence[mujoco.MjModel], substeps: int):
        self.models = list(models)
        self.substeps = substeps
        first = self.models[0]
        self._position = position_columns(first)
        pairs, body = sensed_bodies(first), first.geom_bodyid
        self._links = (body[None] == pairs[:, :1]) & (body != 0)  # (links, geoms)
        self._others = body[None] == pairs[:, 1:]
        self._family = make_family([_put(model, first) for model in self.models])
        blank = copy.copy(first)
        stop_contact_sensors(blank)
        self._blank = mjx.make_data(blank, impl="jax")

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
        return self._state(variant, self._blank.replace(qpos=qpos, qvel=qvel, ctrl=ctrl), stepped=False)

    def step(self, state: PhysicsState, ctrl: Float[Array, "nu"]) -> PhysicsState:
        model = self._family.model(state.variant)
        data = self._blank.replace(qpos=state.qpos, qvel=state.qvel, qacc_warmstart=state.memory, ctrl=ctrl)
        data, _ = jax.lax.scan(lambda d, _: (mjx.step(model, d), None), data, length=self.substeps)
        return self._state(state.variant, data, stepped=True)

    def _state(self, variant: Int[Array, ""], data: mjx.Data, stepped: bool) -> PhysicsState:
        model = self._family.model(variant)
        qpos, qvel, warmstart, unstable = recovered(model.qpos0, data.qpos, data.qvel, data.qacc_warmstart)
        contact = self._pressed(data) if stepped else jnp.zeros((len(self._links), 6))
        # MJX leaves positions that derive from the state a substep behind it.
        data = mjx.kinematics(model, data.replace(qpos=qpos, qvel=qvel))
        data = mjx.sensor_pos(model, mjx.com_pos(model, data))
        return PhysicsState(
            variant=variant,
            qpos=data.qpos,
            qvel=data.qvel,
            sensordata=data.sensordata[self._position],
            contact=jnp.where(unstable > 0, 0.0, contact),
            memory=warmstart,
            unstable=unstable,
        )

    def _pressed(self, data: mjx.Data) -> Float[Array, "links 6"]:
        """What the C engine's contact sensors tell, which MJX has not for whole bodies."""
        contact = data._impl.contact
        rows = np.flatnonzero(contact.dim >= 3)
        begins = np.asarray(contact.efc_address)[rows]
        along = data._impl.efc_force[begins[:, None] + np.arange(3)]  # the normal, from the first geom to the second
        force = jnp.einsum("cki,ck->ci", contact.frame[rows], along)
        one, two = contact.geom[rows].T
        links, others = jnp.asarray(self._links), jnp.asarray(self._others)
        sign = 1.0 * (links[:, one] & others[:, two]) - 1.0 * (links[:, two] & others[:, one])  # (links, contacts)
        weight = jnp.abs(sign) * jnp.linalg.norm(force, axis=-1)
        point = weight @ contact.pos[rows] / jnp.maximum(weight.sum(axis=1, keepdims=True), 1e-9)
        return jnp.concatenate([sign @ force, point], axis=1)


def _with_friction(models: list[mujoco.MjModel]) -> list[mujoco.MjModel]:
    """The models, with a little friction where pairs have none: MJX has no such contacts with elliptic cones."""
    for model in models:
        slides = model.pair_dim == 1
        model.pair_friction[slides] = _LITTLE
        model.pair_dim[slides] = 3
    return models


def _put(model: mujoco.MjModel, first: mujoco.MjModel) -> mjx.Model:
    if model.nhfield:
        raise InputError("engine 'mjx' runs no height fields in families of models; use engine 'native'")
    model = copy.copy(model)
    stop_contact_sensors(model)
    put = mjx.put_model(model, impl="jax")
    # Compiled in, and different from hand to hand, but read for height fields alone.
    return put.replace(_impl=put._impl.replace(geom_rbound_hfield=np.array(first.geom_rbound)))
