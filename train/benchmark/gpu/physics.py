"""An engine's agreement with MuJoCo's C engine, and its physics steps a second over numbers of worlds."""

import dataclasses
import functools
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np

from envs.agreement import LIMITS, c_engine, departure, free_and_gripping, rolled
from envs.physics.solver_load import solver_load
from envs.tracking import TrackingEnv
from mjx_hand.view.figures import plots
from train.benchmark.contestants import make_script, physics
from train.benchmark.gpu.bench import Bench
from train.benchmark.gpu.device import memory_in_use
from train.benchmark.gpu.record import Record
from train.benchmark.memory import fitting
from train.benchmark.timing import rates

_FIRST_POINT = 25.0  # seconds that a point takes on a GPU, before one has been measured
_MORE = 1.5  # what the next point may take of the last one's seconds


def agreement(bench: Bench, engine: str, record: Record, keep: Callable[[], None]) -> None:
    """Whether the engine comes as near to the C engine as the tests demand."""
    env = bench.env(engine, "pinch")
    if engine == "mjx":  # its limits are for a hand that does not meet itself (`envs.agreement.LIMITS`)
        task = dataclasses.replace(env.task, contacts="ground")
        env = TrackingEnv(env.demonstrations, env.hands, engine, task, randomize=env.randomize)
    worlds = free_and_gripping(env)
    given = (worlds.variant, worlds.qpos, worlds.qvel, worlds.controls)
    with bench.timed() as took:
        found = jax.block_until_ready(rolled(env.engine)(*given))
    off = departure(found, rolled(c_engine(env.engine))(*given), worlds.gripping)
    table = record.table("engine", "worlds", "off from the C engine, m", "at most, m")
    # The C engine beside itself differs by nothing.
    limits = LIMITS.get(engine)
    table.add(engine, "free", off.free, limits and limits.free)
    for share in limits.gripped if limits else (0.5, 1.0):
        table.add(engine, f"gripping, {share:.0%} of them", off.quantile(share), limits and limits.gripped[share])
    complaints = off.complaints(limits) if limits else []
    record.notes.append(f"{engine}: {'; '.join(complaints) or 'within all limits'}.")
    record.notes.append(f"{engine}: compiled, kernels built, and run for the first time in {took[0]:.1f} s.")
    keep()


def sweep(bench: Bench, engine: str, worlds: Sequence[int], record: Record, keep: Callable[[], None]) -> None:
    """Physics steps a second of the engine alone, over numbers of worlds and grasp types."""
    scale = bench.scale
    record.notes.append(
        "Worlds follow the demonstrations' targets with random residuals and start anew every five control steps, each "
        "with its own hand and object. *Peak* is JAX's since the process began, *in use* that of all processes."
    )
    table = record.table(
        *("grasp", "engine", "worlds", "physics steps/s", "least", "greatest", "control steps/s"),
        *("compiling, s", "to the first step, s", "peak, MiB", "in use, MiB"),
    )
    loads = record.table(
        "grasp",
        "engine",
        "solver iterations",
        "constraint rows",
        "contacts",
        "most rows of a world",
        "rows there is room for",
    )
    panels: dict[str, dict[str, np.ndarray]] = {}
    expected = _FIRST_POINT * scale.patience
    for grasp in scale.grasps:
        env = bench.env(engine, grasp)
        for count in worlds:
            if not bench.enough(record, f"{grasp}, {engine}, {count:,} worlds", expected):
                continue
            with bench.timed() as took:
                rate, cells = _point(bench, env, grasp, count)
            expected = _MORE * took[0]
            if rate is None:
                record.notes.append(f"{grasp}, {engine}: {count:,} worlds do not fit into memory.")
                continue
            table.add(grasp, engine, count, *rate, *cells)
            curve = panels.setdefault(grasp, {}).setdefault(engine, np.empty((0, 4)))
            panels[grasp][engine] = np.vstack([curve, [count, *rate[:3]]])
            keep()
        if engine != "native" and bench.enough(record, f"{grasp}, {engine}: the solver's load", expected):
            loads.add(grasp, engine, *_load(env, scale.load_worlds))
            keep()
    if engine == "mjx":
        record.notes.append("MJX does not tell the iterations of its solver.")
    if panels:
        record.figures[f"physics-{engine}"] = plots.throughput(panels, label="physics steps/s")


def _point(
    bench: Bench, env: TrackingEnv, grasp: str, count: int
) -> tuple[tuple[float, float, float, float] | None, tuple[float | None, ...]]:
    """Rates (physics steps a second: median, least, greatest; control steps) of so many worlds, and what it took."""
    with bench.timed() as took:
        contestant = fitting(functools.partial(physics, env, count))
    if contestant is None:
        return None, ()
    if count == bench.scale.ppo_worlds:
        bench.contestants[env.engine.name, grasp, count] = contestant
    (rate,) = rates([contestant], bench.scale.runs, bench.scale.seconds)
    each = env.engine.substeps
    peak = contestant.memory and contestant.memory.device
    cells = (contestant.compile_seconds, took[0], None if peak is None else peak // 2**20, memory_in_use())
    return (each * rate.median, each * rate.least, each * rate.greatest, rate.median), cells


def _load(env: TrackingEnv, count: int) -> tuple[float | None, ...]:
    """The solver's load under the script that speed is measured with."""
    script = make_script(env, count)
    start = jax.jit(jax.vmap(env.start))(script.variant, script.frame).pipeline_state.physics
    load = solver_load(env.engine, start, jnp.asarray(script.controls, jnp.float32))
    return load.iterations, load.rows, load.contacts, load.most_rows, load.room
