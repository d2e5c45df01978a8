"""What is measured: an engine with the environment around it, an engine alone, and MuJoCo's own ways to step.

Engines alone and MuJoCo's own ways do the same work: worlds that start all over the demonstrations follow them for
`PASS` control steps, with random residuals on the targets, and start again.
"""

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jax.experimental.compilation_cache import compilation_cache
from jaxtyping import Float, Int
from mujoco.rollout import Rollout

from envs.observation import residual_scale
from envs.parallel import ParallelEnv
from envs.tracking import TrackingEnv

PASS = 5  # control steps from start to start: worlds stay near the states they were given


@dataclass(frozen=True)
class Memory:
    """Memory in bytes; None where the system does not tell.

    Attributes:
        host: how much the process's resident memory grew at its peak, while the contestant was made, compiled and run
            for the first time.
        device: the accelerator's peak since the process began.
    """

    host: int | None
    device: int | None


@dataclass(frozen=True)
class Contestant:
    """Something that steps worlds.

    Attributes:
        name: of the engine or function.
        scope: "environment" or "physics".
        worlds: how many.
        compile_seconds: until it could run for the first time; None where nothing is compiled.
        advance: steps all worlds by a number of control steps, a multiple of `unit`; returns their qpos then.
        unit: see `advance`.
        memory: what it took, where that was measured (`train.benchmark.memory`).
    """

    name: str
    scope: str
    worlds: int
    compile_seconds: float | None
    advance: Callable[[int], Any]
    unit: int = 1
    memory: Memory | None = None


@dataclass(frozen=True)
class Script:
    """Where each world starts, and what its actuators are told at each control step of a pass.

    Attributes:
        variant, frame: the demonstration and the frame that each world starts from.
        controls: targets of wrist and hinges.
    """

    variant: Int[np.ndarray, "n"]
    frame: Int[np.ndarray, "n"]
    controls: Float[np.ndarray, "t n u"]


def make_script(env: TrackingEnv, worlds: int) -> Script:
    """Worlds spread evenly over all frames of all demonstrations, led by the demonstration plus random residuals."""
    rng = np.random.default_rng(0)
    length = np.asarray(env.reference.length)
    variant = np.arange(worlds) % len(length)
    share = (np.arange(worlds) + 0.5) / worlds  # one world starts in the middle, where it holds the object
    frame = (share * (length[variant] - PASS - 1)).astype(int)
    controls, residual = [], np.zeros((worlds, env.action_size))
    for k in range(1, PASS + 1):
        action = rng.uniform(-1, 1, residual.shape)
        smoothing = env.task.smoothing
        residual = (
            smoothing * residual
            + (1 - smoothing) * np.asarray(residual_scale(env.task, env.body.names, env.body.reach)) * action
        )
        target = np.asarray(env.reference.controls)[variant, frame + k] + residual
        controls.append(np.clip(target, *env.engine.models[0].actuator_ctrlrange.T))
    return Script(variant, frame, np.array(controls))


def environment(env: TrackingEnv, worlds: int) -> Contestant:
    """The whole environment as it is trained on, restarts included, under uniformly random actions."""
    parallel = ParallelEnv(env)
    state = jax.jit(parallel.reset)(jax.random.split(jax.random.key(0), worlds))

    def advance(state: Any, key: jax.Array, steps: jax.Array) -> Any:
        def step(k: Any, state: Any) -> Any:
            shape = (worlds, env.action_size)
            return parallel.step(state, jax.random.uniform(jax.random.fold_in(key, k), shape, minval=-1, maxval=1))

        return jax.lax.fori_loop(0, steps, step, state)

    run, seconds = compiled(advance, state, jax.random.key(1), 1)
    key = jax.random.key(1)

    def onwards(steps: int) -> Float[jax.Array, "n q"]:
        nonlocal state, key
        key, now = jax.random.split(key)
        state = jax.block_until_ready(run(state, now, steps))
        return state.pipeline_state.physics.qpos

    return Contestant(env.engine.name, "environment", worlds, seconds, onwards)


def physics(env: TrackingEnv, worlds: int) -> Contestant:
    """The engine alone, following the script."""
    script = make_script(env, worlds)
    start = jax.jit(jax.vmap(env.start))(script.variant, script.frame).pipeline_state.physics

    def advance(start: Any, controls: jax.Array, steps: jax.Array) -> Any:
        def step(k: Any, state: Any) -> Any:
            state = jax.tree.map(lambda a, b: jnp.where(k % PASS == 0, a, b), start, state)
            return jax.vmap(env.engine.step)(state, controls[k % PASS])

        return jax.lax.fori_loop(0, steps, step, start)

    controls = jnp.asarray(script.controls, jnp.float32)
    run, seconds = compiled(advance, start, controls, 1)
    return Contestant(
        env.engine.name,
        "physics",
        worlds,
        seconds,
        lambda steps: jax.block_until_ready(run(start, controls, steps)).qpos,
    )


def step_loop(env: TrackingEnv) -> Contestant:
    """One world in a Python loop over `mujoco.mj_step`, following the script."""
    script = make_script(env, 1)
    model = env.engine.models[script.variant[0]]
    data, start = mujoco.MjData(model), _full_states(env, script)[0]
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS

    def advance(steps: int) -> Float[np.ndarray, "1 q"]:
        for _ in range(steps // PASS):
            mujoco.mj_setState(model, data, start, kind)
            for control in script.controls[:, 0]:
                data.ctrl[:] = control
                for _ in range(env.engine.substeps):
                    mujoco.mj_step(model, data)
        return data.qpos[None].copy()

    return Contestant("mujoco.mj_step", "physics", 1, None, advance, unit=PASS)


def open_rollout(env: TrackingEnv, worlds: int, threads: int) -> Contestant:
    """`mujoco.rollout` with a pool of threads that stays, following the script."""
    script = make_script(env, worlds)
    models = [env.engine.models[v] for v in script.variant]
    count = min(threads, worlds)
    data = [mujoco.MjData(models[0]) for _ in range(count)]
    pool = Rollout(nthread=count if count > 1 else 0)  # 0: in the calling thread
    start = _full_states(env, script)
    controls = np.repeat(script.controls.swapaxes(0, 1), env.engine.substeps, axis=1)
    states, sensors = (np.empty((*controls.shape[:2], size)) for size in (start.shape[1], models[0].nsensordata))

    def advance(steps: int) -> Float[np.ndarray, "n q"]:
        for _ in range(steps // PASS):
            pool.rollout(models, data, start, controls, state=states, sensordata=sensors)
        return states[:, -1, 1 : 1 + models[0].nq].copy()  # time comes first

    return Contestant("mujoco.rollout", "physics", worlds, None, advance, unit=PASS)


def _full_states(env: TrackingEnv, script: Script) -> Float[np.ndarray, "n s"]:
    """MuJoCo's full physics state of each world at its start."""
    physics = jax.jit(jax.vmap(env.start))(script.variant, script.frame).pipeline_state.physics
    model, kind = env.engine.models[0], mujoco.mjtState.mjSTATE_FULLPHYSICS
    data = mujoco.MjData(model)
    states = np.zeros((len(script.variant), mujoco.mj_stateSize(model, kind)))
    for row, qpos, qvel in zip(states, np.asarray(physics.qpos), np.asarray(physics.qvel), strict=True):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_getState(model, data, row, kind)
    return states


def compiled(function: Callable[..., Any], *args: Any) -> tuple[Callable[..., Any], float]:
    """The compiled function, and how long compiling took without kept compilations."""
    with _compiling_anew():
        started = time.perf_counter()
        compiled = jax.jit(function).lower(*args).compile()
        return compiled, time.perf_counter() - started


@contextlib.contextmanager
def _compiling_anew() -> Iterator[None]:
    """Without JAX's persistent cache, which would turn compile times into times to read a file."""
    before = jax.config.jax_enable_compilation_cache  # type: ignore[attr-defined]
    jax.config.update("jax_enable_compilation_cache", False)
    compilation_cache.reset_cache()  # JAX decides only once whether it has a cache
    try:
        yield
    finally:
        jax.config.update("jax_enable_compilation_cache", before)
        compilation_cache.reset_cache()
