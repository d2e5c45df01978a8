"""Newton's Allegro scene stepped by MuJoCo Warp through MJX, beside the figures that Newton's benchmark has reached."""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
from jaxtyping import Array, UInt
from mujoco import mjx

from envs.physics.solver_load import mean_load, over_steps, step_load
from mjx_hand.errors import InputError
from train.benchmark.contestants import compiled
from train.benchmark.gpu.allegro import COMMANDS, SUBSTEPS, allegro_model
from train.benchmark.gpu.bench import Bench
from train.benchmark.gpu.record import Record

# Physics steps a second of the same scene on 8192 worlds, as published for Newton.
PUBLISHED = {"RTX PRO 6000": 3.35e6, "RTX 5090": 3.1e6}
PUBLISHED_ITERATIONS = 1.18
_ROWS, _CONTACTS = 64, 48  # that a world has room for; Newton's benchmark has 60 and 35


def allegro(bench: Bench, record: Record, keep: Callable[[], None]) -> None:
    """Steps a second of the scene, its solver's load, and what is published.

    Raises:
        InputError: Warp, or the package that carries the hand, is not installed.
    """
    if find_spec("warp") is None:
        raise InputError("the scene is stepped by MuJoCo Warp, which is not installed: pip install 'mjx-hand[warp]'")
    scale = bench.scale
    worlds, commands = scale.peer_worlds, scale.peer_commands
    model = allegro_model()
    with bench.timed() as ready:
        run, seconds = compiled(stepper(model, worlds, commands), jax.random.key(0))
        jax.block_until_ready(run(jax.random.key(0)))
    table = record.table(
        *("GPU", "worlds", "physics steps/s", "solver iterations", "constraint rows", "contacts"),
        *("most rows", "compiling, s", "to the end of the first run, s"),
    )
    steps, last = worlds * commands * SUBSTEPS, 0.0
    most_rows, diverged = 0.0, False
    for k in range(scale.runs):
        if not bench.enough(record, f"run {k + 1}", last):
            break
        with bench.timed() as took:
            qpos, loads = jax.block_until_ready(run(jax.random.key(k + 1)))
        load, last = mean_load(loads), took[0]
        most_rows, diverged = max(most_rows, load.most_rows), diverged or not bool(jnp.isfinite(qpos).all())
        here = (load.iterations, load.rows, load.contacts, load.most_rows, seconds, ready[0])
        table.add(f"here, run {k + 1}", worlds, steps / last, *here)
        keep()
    for name, rate in PUBLISHED.items():
        table.add(f"{name} (published, Newton)", 8192, rate, PUBLISHED_ITERATIONS, *[None] * 5)
    if diverged:
        record.notes.append("Some worlds diverged.")
    if most_rows >= _ROWS:
        record.notes.append(
            f"Worlds had more constraint rows than the {_ROWS} there is room for; the rest was dropped."
        )
    record.notes.append(
        f"Cube in a left Allegro hand: 1/6000 s × {SUBSTEPS} a command, {commands} commands from the start "
        f"(published: {COMMANDS}), elliptic cones, at most {model.opt.iterations} iterations, self-collision, "
        "random targets. Links are the URDF's boxes where Newton has hulls of meshes."
    )


def stepper(model: mujoco.MjModel, worlds: int, commands: int) -> Callable[[UInt[Array, ""]], tuple[Array, Any]]:
    """A function from a random key to where worlds are after so many commands, and the solver's load at each."""
    from envs.physics.warp import put_quietly  # importing it needs Warp

    put = put_quietly(model)
    blank = mjx.make_data(model, impl="warp", naconmax=_CONTACTS * worlds, naccdmax=_CONTACTS * worlds, njmax=_ROWS)

    def command(data: mjx.Data, key: UInt[Array, ""]) -> tuple[mjx.Data, dict[str, Array]]:
        data = data.replace(ctrl=jax.random.uniform(key, (model.nu,), minval=-1.0, maxval=1.0))

        def step(data: mjx.Data, _: None) -> tuple[mjx.Data, dict[str, Array]]:
            data = mjx.step(put, data)
            return data, step_load(data)

        data, loads = jax.lax.scan(step, data, length=SUBSTEPS)
        return data, over_steps(loads)

    def world(key: UInt[Array, ""]) -> tuple[Array, dict[str, Array]]:
        data, loads = jax.lax.scan(command, blank, jax.random.split(key, commands))
        return data.qpos, loads

    return lambda key: jax.vmap(world)(jax.random.split(key, worlds))
