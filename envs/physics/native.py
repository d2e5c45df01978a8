"""The `native` engine: MuJoCo's C engine on all cores, through `mujoco.batch.Batch`.

The simulation state crosses into JAX bit-cast from float64 to pairs of uint32, so that stepping is a pure and exact
function of what JAX holds: it survives scans, `where` and checkpoints without rounding. Only NumPy runs in the
callback. The models stay on the host; the engine's tables are the numbers of the functions that step them.
"""

import copy
import os
import threading
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float, Int
from mujoco import batch

from envs.physics.engine import PhysicsState
from envs.physics.host_call import HostCallback, call_host
from envs.physics.solver import gauss_seidel
from mjx_hand.player.contact_force import contact_columns, position_columns

# Fields of the integration state that one step hands to the next, in its order and at the front of its rows; what comes
# next, the control, comes with each step.
CARRIED = ("time", "qpos", "qvel", "act", "qacc_warmstart")
# Warnings that mean the engine found a bad number and reset the simulation by itself.
DIVERGED = [
    int(w)
    for w in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
        mujoco.mjtWarning.mjWARN_BADCTRL,
    )
]


def diverged(data: mujoco.MjData) -> bool:
    """Whether the engine found a bad number since this simulation began, and reset it by itself."""
    return any(data.warning[kind].number for kind in DIVERGED)


class _Worlds(NamedTuple):
    """Worlds as two batches.

    Attributes:
        moving: steps them.
        placed: the same without contacts. It says where everything is after a step, which contacts do not change and
            take most of the time to find.
    """

    moving: batch.Batch
    placed: batch.Batch


def make(models: Sequence[mujoco.MjModel], substeps: int) -> "NativeEngine":
    """The engine over copies of the models with its own solver settings."""
    return NativeEngine(gauss_seidel(models), substeps)


def cores() -> int:
    """Cores that this process may use, where the system tells, else all of the machine's."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class NativeEngine:
    """See `envs.physics.engine.Engine`."""

    name = "native"

    def __init__(self, models: Sequence[mujoco.MjModel], substeps: int, threads: int | None = None):
        self.models = list(models)
        self.substeps = substeps
        self._placed = [copy.copy(model) for model in self.models]
        for model in self._placed:
            model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self._threads = threads or cores()
        self._worlds: dict[int, _Worlds] = {}
        self._running: dict[int, np.ndarray] = {}  # the variants that each cached pair is set to
        self._lock = threading.Lock()
        model = self.models[0]
        sizes = {"time": 1, "qpos": model.nq, "qvel": model.nv, "act": model.na, "qacc_warmstart": model.nv}
        ends = np.cumsum([sizes[field] for field in CARRIED])
        self._slices = {f: slice(e - sizes[f], e) for f, e in zip(CARRIED, ends, strict=True)}
        self._size = int(ends[-1])
        self._position, self._contact = position_columns(model), contact_columns(model)
        self._shapes = (
            jax.ShapeDtypeStruct((2 * self._size,), jnp.uint32),
            jax.ShapeDtypeStruct((model.nq,), jnp.float32),
            jax.ShapeDtypeStruct((model.nv,), jnp.float32),
            jax.ShapeDtypeStruct((len(self._position),), jnp.float32),
            jax.ShapeDtypeStruct(self._contact.shape, jnp.float32),
            jax.ShapeDtypeStruct((), jnp.float32),
        )
        self.tables = jnp.array([HostCallback(f).number for f in (self._host_reset, self._host_step)], jnp.int32)

    def with_tables(self, tables: Any) -> "NativeEngine":
        other = copy.copy(self)
        other.tables = tables
        return other

    def reset(
        self, variant: Int[Array, ""], qpos: Float[Array, "nq"], qvel: Float[Array, "nv"], ctrl: Float[Array, "nu"]
    ) -> PhysicsState:
        return self._state(variant, call_host(self.tables[0], self._shapes, variant, qpos, qvel))

    def step(self, state: PhysicsState, ctrl: Float[Array, "nu"]) -> PhysicsState:
        return self._state(state.variant, call_host(self.tables[1], self._shapes, state.variant, state.memory, ctrl))

    def _state(self, variant: Int[Array, ""], out: tuple[Array, ...]) -> PhysicsState:
        memory, qpos, qvel, sensordata, contact, unstable = out
        return PhysicsState(
            variant=variant,
            qpos=qpos,
            qvel=qvel,
            sensordata=sensordata,
            contact=contact,
            memory=memory,
            unstable=unstable,
        )

    def _host_reset(self, variant: Any, qpos: Any, qvel: Any) -> tuple[np.ndarray, ...]:
        variant, qpos, qvel = np.asarray(variant), np.asarray(qpos), np.asarray(qvel)
        lead = variant.shape
        carried = np.zeros((variant.size, self._size))
        carried[:, self._slices["qpos"]] = qpos.reshape(variant.size, -1)
        carried[:, self._slices["qvel"]] = qvel.reshape(variant.size, -1)
        with self._lock:
            _, placed = self._load(variant.reshape(-1))
            unstable = self._place(placed, carried)
            return self._unload(placed, np.zeros((variant.size, *self._contact.shape)), unstable, lead)

    def _host_step(self, variant: Any, memory: Any, ctrl: Any) -> tuple[np.ndarray, ...]:
        variant, memory, ctrl = np.asarray(variant), np.asarray(memory), np.asarray(ctrl)
        lead = variant.shape
        carried = np.ascontiguousarray(memory.reshape(variant.size, -1)).view(np.float64)
        with self._lock:
            moving, placed = self._load(variant.reshape(-1))
            moving.state[:, : self._size] = carried
            moving.state[:, self._size : self._size + ctrl.shape[-1]] = ctrl.reshape(variant.size, -1)
            moving.warning[...] = 0
            moving.step(nstep=self.substeps)
            # Without it positions derived from the state, sensors among them, lag one substep behind it.
            unstable = self._place(placed, moving.state[:, : self._size]) | _diverged(moving)
            contact = np.where(unstable[:, None, None], 0.0, moving.bind("sensordata")[:, self._contact])
            return self._unload(placed, contact, unstable, lead)

    def _load(self, variant: np.ndarray) -> _Worlds:
        """Worlds of this number that run the given variants."""
        count = variant.size
        if count not in self._worlds:
            threads = min(self._threads, count)
            made = _Worlds(*(batch.Batch(m[0], nsim=count, nthread=threads) for m in (self.models, self._placed)))
            made.placed.bind("sensordata")
            made.moving.bind("sensordata")
            self._worlds[count] = made
            self._running[count] = np.full(count, -1)
        worlds = self._worlds[count]
        if not np.array_equal(self._running[count], variant):
            worlds.moving.set_models([self.models[v] for v in variant])
            worlds.placed.set_models([self._placed[v] for v in variant])
            self._running[count] = variant.copy()
        return worlds

    def _place(self, placed: batch.Batch, carried: np.ndarray) -> np.ndarray:
        """Work out where everything is in these states; which worlds had a bad number, and were reset for it."""
        placed.state[:, : self._size] = carried
        placed.warning[...] = 0
        placed.forward(stage=mujoco.mjtStage.mjSTAGE_POS)
        return _diverged(placed)

    def _unload(
        self, placed: batch.Batch, contact: np.ndarray, unstable: np.ndarray, lead: tuple[int, ...]
    ) -> tuple[np.ndarray, ...]:
        carried = placed.state[:, : self._size].copy()
        moving = [carried[:, self._slices[field]] for field in ("qpos", "qvel")]
        fields = [field.astype(np.float32) for field in (*moving, placed.bind("sensordata")[:, self._position])]
        bits = carried.view(np.uint32)
        return (
            bits.reshape(*lead, -1),
            *(f.reshape(*lead, -1) for f in fields),
            contact.astype(np.float32).reshape(*lead, *self._contact.shape),
            unstable.astype(np.float32).reshape(lead),
        )


def _diverged(worlds: batch.Batch) -> np.ndarray:
    """Which worlds the engine found a bad number in."""
    return worlds.warning[:, DIVERGED, 1].any(axis=1)
