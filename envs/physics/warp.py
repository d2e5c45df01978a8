"""The `warp` engine: MuJoCo Warp behind MJX, for NVIDIA GPUs; it also runs, slowly, on a CPU.

Kernels are built on first use, in about a minute, and kept in Warp's own cache.
"""

import copy
import dataclasses
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import warp
from jaxtyping import Array, Float, Int
from mujoco import mjx
from mujoco.mjx.third_party.mujoco_warp._src.types import OverflowType
from mujoco.mjx.warp import types as warp_types

from envs.physics.engine import PhysicsState
from envs.physics.family import Family, leaf_names, make_family
from envs.physics.recovery import recovered
from envs.physics.solver import newton
from mjx_hand.errors import InputError
from mjx_hand.player.contact_force import contact_columns
from mjx_hand.rotations import quaternion_to_matrix

# Else a line for each of a hundred kernels. Where Warp is not installed, its name means this module to type checkers.
warp.config.log_level = warp.LOG_WARNING  # pyright: ignore[reportAttributeAccessIssue]

_PLANE, _SPHERE = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_SPHERE
_CAPSULE, _CYLINDER = mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER
_MESH = mujoco.mjtGeom.mjGEOM_MESH


def make(models: Sequence[mujoco.MjModel], substeps: int) -> "WarpEngine":
    """The engine over copies of the models with the settings of MuJoCo's C engine, whose algorithms these are."""
    return WarpEngine(newton(models), substeps)


class WarpEngine:
    """See `envs.physics.engine.Engine`.

    Warp steps all worlds in one call and keeps their contacts in one buffer, so its size must be known: a batching rule
    of our own counts the worlds, and flattens nested `vmap`s into one call.
    """

    name = "warp"

    def __init__(self, models: Sequence[mujoco.MjModel], substeps: int):
        self.models = list(models)
        self.substeps = substeps
        models = [_put(model, self.models[0]) for model in self.models]
        self._family = make_family(models)
        _check_variable(self._family, models[0])
        self._sites = _sensor_sites(self.models[0])
        self._contact = contact_columns(self.models[0])
        self._still = _geoms_of_the_world(self.models[0])
        self._capacity = _capacity(self.models[0])

    @property
    def tables(self) -> Any:
        return self._family.leaves

    def with_tables(self, tables: Any) -> "WarpEngine":
        other = copy.copy(self)
        other._family = dataclasses.replace(self._family, leaves=tables)
        return other

    def reset(
        self, variant: Int[Array, ""], qpos: Float[Array, "nq"], qvel: Float[Array, "nv"], ctrl: Float[Array, "nu"]
    ) -> PhysicsState:
        return self._state(variant, qpos, qvel, jnp.zeros_like(qvel), jnp.zeros(self._contact.shape))

    def step(self, state: PhysicsState, ctrl: Float[Array, "nu"]) -> PhysicsState:
        worlds = (state.variant, state.qpos, state.qvel, state.memory, ctrl)
        qpos, qvel, warmstart, sensordata = _only(_flattening(self._advance)(*(leaf[None] for leaf in worlds)))
        # Warp clamps a control that is no number to its range, unnoticed.
        qpos = jnp.where(jnp.isfinite(ctrl).all(), qpos, jnp.nan)
        return self._state(state.variant, qpos, qvel, warmstart, sensordata[self._contact])

    def _state(self, variant: Array, qpos: Array, qvel: Array, warmstart: Array, contact: Array) -> PhysicsState:
        rest = self._family.model(variant).qpos0
        qpos, qvel, warmstart, unstable = recovered(rest, qpos, qvel, warmstart)
        (sensordata,) = _only(_flattening(self._look)(variant[None], qpos[None]))
        return PhysicsState(
            variant=variant,
            qpos=qpos,
            qvel=qvel,
            sensordata=sensordata,
            contact=jnp.where(unstable > 0, 0.0, contact),
            memory=warmstart,
            unstable=unstable,
        )

    def _advance(self, variant: Array, qpos: Array, qvel: Array, warmstart: Array, ctrl: Array) -> tuple[Array, ...]:
        """`substeps` physics steps of worlds with one leading axis."""
        blank = self._blank(len(variant))

        def one(v: Array, q: Array, qd: Array, w: Array, u: Array) -> tuple[Array, ...]:
            model = self._family.model(v)
            data = self.placed(blank, model).replace(qpos=q, qvel=qd, qacc_warmstart=w, ctrl=u)
            # A loop, not copies of the call: Warp captures a CUDA graph for every set of buffers that it is given.
            data, _ = jax.lax.scan(lambda d, _: (mjx.step(model, d), None), data, length=self.substeps)
            return data.qpos, data.qvel, data.qacc_warmstart, data.sensordata

        return jax.vmap(one)(variant, qpos, qvel, warmstart, ctrl)

    def placed(self, blank: mjx.Data, model: mjx.Model) -> mjx.Data:
        """`blank` with the geoms of the world where this model has them.

        Warp takes geoms that nothing can move from its data, which have been made with the first model.
        """
        position, axes = model.geom_pos, quaternion_to_matrix(model.geom_quat)
        return blank.replace(
            geom_xpos=jnp.where(self._still[:, None], position, blank.geom_xpos),
            geom_xmat=jnp.where(self._still[:, None, None], axes, blank.geom_xmat),
        )

    def _look(self, variant: Array, qpos: Array) -> tuple[Array]:
        """The position sensors of worlds with one leading axis."""
        blank = self._blank(len(variant))

        def one(v: Array, q: Array) -> Array:
            return mjx.kinematics(self._family.model(v), blank.replace(qpos=q)).site_xpos[self._sites].ravel()

        return (jax.vmap(one)(variant, qpos),)

    def _blank(self, worlds: int) -> mjx.Data:
        contacts, near, rows = self._capacity
        return mjx.make_data(
            self.models[0], impl="warp", naconmax=contacts * worlds, naccdmax=near * worlds, njmax=rows
        )


def _flattening(worlds):  # type: ignore[no-untyped-def]
    """`worlds`, a function of arrays with one leading axis, so that `vmap` makes that axis longer instead."""
    mapped = jax.custom_batching.custom_vmap(worlds)

    @mapped.def_vmap
    def _(axis_size, in_batched, *args):  # type: ignore[no-untyped-def]
        full = [
            arg if batched else jnp.broadcast_to(arg, (axis_size, *arg.shape))
            for arg, batched in zip(args, in_batched, strict=True)
        ]
        out = mapped(*(arg.reshape(-1, *arg.shape[2:]) for arg in full))
        return tuple(a.reshape(axis_size, -1, *a.shape[1:]) for a in out), tuple(True for _ in out)

    return mapped


def _only(leaves: tuple[Array, ...]) -> tuple[Array, ...]:
    return tuple(leaf[0] for leaf in leaves)


def put_quietly(model: mujoco.MjModel) -> mjx.Model:
    """The model for Warp, whose settings cap the iterations on purpose: no line for each world that reaches a cap."""
    put = mjx.put_model(model, impl="warp")
    heeded = put.opt._impl.warn_overflow & ~(OverflowType.ITERATIONS | OverflowType.LS_ITERATIONS)
    return put.replace(opt=put.opt.replace(_impl=put.opt._impl.replace(warn_overflow=int(heeded))))


def _put(model: mujoco.MjModel, first: mujoco.MjModel) -> mjx.Model:
    put = put_quietly(model)
    # Compiled in, and different from hand to hand, but read for sleeping islands alone, which these scenes do not have.
    return put.replace(_impl=put._impl.replace(dof_length=np.array(first.dof_length, np.float32)))


def _check_variable(family: Family, model: mjx.Model) -> None:
    """Raise InputError if a field varies that Warp reads for all worlds from the first."""
    per_world = warp_types._BATCH_DIM["Model"]  # fields that Warp does not read are not in it
    names = leaf_names(model)
    varying = [names[k].removeprefix("_impl.") for k in family.varying]
    stuck = [name for name in varying if not per_world.get(name.replace(".", "__"), True)]
    if stuck:
        raise InputError(
            f"engine 'warp' cannot give each world its own {', '.join(stuck)}; "
            "use models that share one value, or engine 'native'"
        )


def _geoms_of_the_world(model: mujoco.MjModel) -> np.ndarray:
    """Which geoms are the world's own, that stand where `geom_pos` has them."""
    fixed = model.body_weldid[model.geom_bodyid] == 0
    if (model.geom_bodyid[fixed] != 0).any():
        raise InputError(
            "engine 'warp' cannot give each world its own place of a geom that is fixed to the world by a body of its "
            "own; put it into the world itself, or use engine 'native'"
        )
    return fixed


def _sensor_sites(model: mujoco.MjModel) -> np.ndarray:
    """The sites whose world positions are the sensors; Warp's other sensors would need a whole forward pass."""
    site, world = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_UNKNOWN
    contact = model.sensor_type == mujoco.mjtSensor.mjSENS_CONTACT
    for k in np.flatnonzero(~contact):
        if model.sensor_type[k] != mujoco.mjtSensor.mjSENS_FRAMEPOS or (
            (model.sensor_objtype[k], model.sensor_reftype[k]) != (site, world)
        ):
            raise InputError(
                f"engine 'warp' reads positions of sites in the world alone, not sensor {model.sensor(k).name!r}; "
                "use engine 'native' or 'mjx'"
            )
    return np.array(model.sensor_objid)[~contact]


def _capacity(model: mujoco.MjModel) -> tuple[int, int, int]:
    """Most contacts, most pairs that take the convex solver, and most constraint rows that one world can have."""
    contacts, convex, rows = 0, 0, int(model.jnt_limited.sum() + model.tendon_limited.sum())
    for i in range(model.ngeom):
        for j in range(i):
            meet = (model.geom_contype[i] & model.geom_conaffinity[j]) | (
                model.geom_contype[j] & model.geom_conaffinity[i]
            )
            if not meet or model.body_weldid[model.geom_bodyid[i]] == model.body_weldid[model.geom_bodyid[j]]:
                continue
            shapes = {int(model.geom_type[i]), int(model.geom_type[j])}
            points = 1 if _SPHERE in shapes else 2 if _CAPSULE in shapes else 8
            contacts += points
            rows += points * int(max(model.geom_condim[i], model.geom_condim[j]))
            convex += not shapes & {_PLANE, _SPHERE} and (_CYLINDER in shapes or _CAPSULE not in shapes)
    # Of named pairs, which are links of the hand: capsules or hulls.
    hulls = [
        _MESH in set(model.geom_type[[a, b]].tolist()) for a, b in zip(model.pair_geom1, model.pair_geom2, strict=True)
    ]
    points = [8 if hull else 2 for hull in hulls]
    contacts += sum(points)
    rows += int(np.dot(points, model.pair_dim))
    convex += sum(hulls)
    return contacts, convex, rows
