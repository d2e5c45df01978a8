"""The `native` engine: MuJoCo's C engine on all cores, through `mujoco.batch.Batch`.

The simulation state crosses into JAX bit-cast from float64 to pairs of uint32, so that stepping is a pure and exact
function of what JAX holds: it survives scans, `where` and checkpoints without rounding. Only NumPy runs in the
callback. The models stay on the host; the engine's tables are the numbers of the functions that step them.
"""

import copy
import os
import threading
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float, Int
from mujoco import batch

from envs.physics.engine import PhysicsState
from envs.physics.host_call import HostFunction, call_host
from envs.physics.solver import gauss_seidel

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
        self._threads = threads or cores()
        self._batches: dict[int, batch.Batch] = {}
        self._running: dict[int, np.ndarray] = {}  # the variants that each cached batch is set to
        self._lock = threading.Lock()
        model = self.models[0]
        sizes = {"time": 1, "qpos": model.nq, "qvel": model.nv, "act": model.na, "qacc_warmstart": model.nv}
        ends = np.cumsum([sizes[field] for field in CARRIED])
        self._slices = {f: slice(e - sizes[f], e) for f, e in zip(CARRIED, ends, strict=True)}
        self._size = int(ends[-1])
        self._shapes = (
            jax.ShapeDtypeStruct((2 * self._size,), jnp.uint32),
            jax.ShapeDtypeStruct((model.nq,), jnp.float32),
            jax.ShapeDtypeStruct((model.nv,), jnp.float32),
            jax.ShapeDtypeStruct((model.nsensordata,), jnp.float32),
            jax.ShapeDtypeStruct((), jnp.float32),
        )
        self.tables = jnp.array([HostFunction(f).number for f in (self._host_reset, self._host_step)], jnp.int32)

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
        memory, qpos, qvel, sensordata, unstable = out
        return PhysicsState(
            variant=variant, qpos=qpos, qvel=qvel, sensordata=sensordata, memory=memory, unstable=unstable
        )

    def _host_reset(self, variant: Any, qpos: Any, qvel: Any) -> tuple[np.ndarray, ...]:
        variant, qpos, qvel = np.asarray(variant), np.asarray(qpos), np.asarray(qvel)
        lead = variant.shape
        carried = np.zeros((variant.size, self._size))
        carried[:, self._slices["qpos"]] = qpos.reshape(variant.size, -1)
        carried[:, self._slices["qvel"]] = qvel.reshape(variant.size, -1)
        with self._lock:
            worlds = self._load(variant.reshape(-1), carried)
            worlds.forward(stage=mujoco.mjtStage.mjSTAGE_POS)
            return self._unload(worlds, lead)

    def _host_step(self, variant: Any, memory: Any, ctrl: Any) -> tuple[np.ndarray, ...]:
        variant, memory, ctrl = np.asarray(variant), np.asarray(memory), np.asarray(ctrl)
        lead = variant.shape
        carried = np.ascontiguousarray(memory.reshape(variant.size, -1)).view(np.float64)
        with self._lock:
            worlds = self._load(variant.reshape(-1), carried)
            worlds.bind("ctrl")[:] = ctrl.reshape(variant.size, -1)
            # POS: without it positions derived from the state, sensors among them, lag one substep behind it.
            worlds.step(nstep=self.substeps, stage=mujoco.mjtStage.mjSTAGE_POS)
            return self._unload(worlds, lead)

    def _load(self, variant: np.ndarray, carried: np.ndarray) -> batch.Batch:
        """A batch of this size whose worlds run the given variants from the given states."""
        count = variant.size
        if count not in self._batches:
            made = batch.Batch(self.models[0], nsim=count, nthread=min(self._threads, count))
            made.bind("sensordata")
            self._batches[count] = made
            self._running[count] = np.full(count, -1)
        worlds = self._batches[count]
        if not np.array_equal(self._running[count], variant):
            worlds.set_models([self.models[v] for v in variant])
            self._running[count] = variant.copy()
        worlds.state[:, : self._size] = carried
        worlds.warning[...] = 0
        return worlds

    def _unload(self, worlds: batch.Batch, lead: tuple[int, ...]) -> tuple[np.ndarray, ...]:
        carried = worlds.state[:, : self._size].copy()
        moving = [carried[:, self._slices[field]] for field in ("qpos", "qvel")]
        fields = [field.astype(np.float32) for field in (*moving, worlds.bind("sensordata"))]
        unstable = (worlds.warning[:, DIVERGED, 1] > 0).any(axis=1).astype(np.float32)
        bits = carried.view(np.uint32)
        return (bits.reshape(*lead, -1), *(f.reshape(*lead, -1) for f in fields), unstable.reshape(lead))
