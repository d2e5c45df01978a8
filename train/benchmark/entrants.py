"""What the `mjbatch` benchmark compares: ways to step the same worlds through the same script on as many threads."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Float
from mujoco import batch

from envs.physics.native import NativeEngine
from train.benchmark.contestants import PASS
from train.benchmark.exchange import Start

NATIVE = "native, within JAX"
MUJOCO_CURRENT, MUJOCO_LATE = "mujoco.batch, sensors current", "mujoco.batch, sensors a substep late"
MJBATCH_CURRENT, MJBATCH_LATE = "mjbatch, sensors current", "mjbatch, sensors a substep late"


@dataclass(frozen=True)
class Entrant:
    """A way to step worlds.

    Attributes:
        name: of it.
        worlds: how many.
        run: goes through the script a number of times; the seconds of wall and of CPU time that took.
        end: the generalised positions that one pass leads to.
    """

    name: str
    worlds: int
    run: Callable[[int], tuple[float, float]]
    end: Callable[[], Float[np.ndarray, "n nq"]]


def native(engine: NativeEngine, start: Start) -> Entrant:
    """The engine as training calls it, from a compiled function."""
    controls = jnp.asarray(start.script.controls)
    state = jax.jit(jax.vmap(engine.reset))(start.script.variant, start.qpos, start.qvel, controls[0])

    @jax.jit
    def advance(state: Any, controls: jax.Array, passes: jax.Array) -> Any:
        def step(k: Any, moved: Any) -> Any:
            moved = jax.tree.map(lambda a, b: jnp.where(k % PASS == 0, a, b), state, moved)
            return jax.vmap(engine.step)(moved, controls[k % PASS])

        return jax.lax.fori_loop(0, PASS * passes, step, state)

    def run(passes: int) -> None:
        jax.block_until_ready(advance(state, controls, passes))

    return Entrant(NATIVE, len(start.qpos), _timed(run), lambda: np.asarray(advance(state, controls, 1).qpos))


def mujoco_batch(engine: NativeEngine, start: Start, threads: int, current: bool) -> Entrant:
    """MuJoCo's own batch on the engine's models, called from Python.

    Args:
        engine: whose models and substeps.
        start: where worlds start, and what they are told.
        threads: how many step.
        current: sensors belong to the state that a control step leads to.
    """
    worlds = len(start.qpos)
    made = batch.Batch(engine.models[0], nsim=worlds, nthread=min(threads, worlds))
    made.set_models([engine.models[v] for v in start.script.variant])
    made.bind("qpos")[...], made.bind("qvel")[...] = start.qpos, start.qvel
    made.bind("sensordata")
    state, control = made.state.copy(), made.bind("ctrl")
    stage = mujoco.mjtStage.mjSTAGE_POS if current else mujoco.mjtStage.mjSTAGE_NONE

    def run(passes: int) -> None:
        for _ in range(passes):
            made.state[...] = state
            for controls in start.script.controls:
                control[...] = controls
                made.step(nstep=engine.substeps, stage=stage)

    def end() -> Float[np.ndarray, "n nq"]:
        run(1)
        return made.bind("qpos").copy()

    return Entrant(MUJOCO_CURRENT if current else MUJOCO_LATE, worlds, _timed(run), end)


def mjbatch(ask: Callable[..., Any], key: str, start: Start, current: bool) -> Entrant:
    """Worlds that another process made under a key; `ask` is `MjbatchProcess.ask`, `current` as of `mujoco_batch`."""

    def run(passes: int) -> tuple[float, float]:
        wall, cpu = ask(do="run", name=key, passes=passes)
        return wall, cpu

    name = MJBATCH_CURRENT if current else MJBATCH_LATE
    return Entrant(name, len(start.qpos), run, lambda: np.array(ask(do="end", name=key)))


def _timed(run: Callable[[int], None]) -> Callable[[int], tuple[float, float]]:
    def timed(passes: int) -> tuple[float, float]:
        wall, cpu = time.perf_counter(), time.process_time()
        run(passes)
        return time.perf_counter() - wall, time.process_time() - cpu

    return timed
