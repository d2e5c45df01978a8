"""`python -m train.benchmark convergence`: what is left to solve when the solver stops, under training's commands.

The grasps of `solver` follow smooth commands. In training targets jump at each control step by random residuals, and
the last step's solution says less about the next. Here worlds all over the demonstrations are given such targets; each
setting then takes the same control steps from the same states. Where they end is compared with two ends: that of 1000
sweeps, and that of Newton's method, where conjugate gradients end too. The two differ, because Gauss-Seidel's sweeps
solve a contact's normal force and its friction in turns, which with elliptic cones can come to rest elsewhere.
"""

import contextlib
import dataclasses
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from envs.grasps import grasp_names, grasp_type
from envs.physics.engine import PhysicsState
from envs.physics.native import NativeEngine
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.progress import counter
from train.benchmark.contestants import make_script
from train.benchmark.engines import small_env
from train.benchmark.report_files import write_report
from train.benchmark.solver import CHOSEN, SWEEP, Settings, newton
from train.reports.machine import machine

SCHEMA = "mjx-hand/benchmark-convergence/1"
COMPARED = (CHOSEN, "PGS 10", "PGS 20", "PGS 30", "Newton 10, dense", "Newton 10, sparse", "Newton 100, sparse")
_PACKAGES = ("mjx-hand", "mujoco", "jax", "numpy")
_ENDS = {
    "1000 sweeps": Settings({"iterations": 1000, "tolerance": 0.0}),
    "Newton's": newton(200, tolerance=1e-12, ls_iterations=200),
}
_Step = Callable[[PhysicsState, Float[jax.Array, "n u"]], PhysicsState]
_SHARES = (50, 90, 99)  # percent of the control steps that end as near as a column says


@dataclasses.dataclass(frozen=True)
class Options:
    """Measure how far a control step of training ends from the solved one, and what it costs.

    Attributes:
        grasps: the types; all if none is named.
        worlds: how many there are, all over the demonstrations.
        runs: timed runs of each setting, of which the median is given.
        out: folder for convergence.md and convergence.json.
        demonstrations: folder below which demonstration sets are kept, and made where missing.
    """

    grasps: tuple[str, ...] = ()
    worlds: int = 256
    runs: int = 5
    out: Path = Path("outputs/benchmark")
    demonstrations: Path = Path("outputs/demonstrations")


@dataclasses.dataclass(frozen=True)
class Figures:
    """What one setting came to on one grasp type.

    Attributes:
        steps: physics steps a second of CPU time, median of the runs.
        object_off: how far the object ends from each of `_ENDS` (m), at the shares of `_SHARES`.
        hinges_off: the same of the hinge that is furthest off (rad).
    """

    steps: float
    object_off: Mapping[str, Sequence[float]]
    hinges_off: Mapping[str, Sequence[float]]


def report(options: Options) -> list[str]:
    """Measure, write the files, and return the lines of the report.

    Raises:
        InputError: for options out of range, or a folder that cannot be written.
    """
    if options.worlds < 1 or options.runs < 1:
        raise InputError(f"{options.worlds} worlds, {options.runs} runs; give at least 1 of each")
    grasps = [grasp_type(name).name for name in options.grasps or grasp_names()]
    figures = {}
    with (
        contextlib.redirect_stdout(sys.stderr),  # progress; the report alone goes to standard output
        counter(len(grasps) * (options.runs * len(COMPARED) + 1), "stepping") as advance,
    ):
        for grasp in grasps:
            env = small_env("native", grasp, options.demonstrations)
            state, controls = moments(env, options.worlds)
            solved = {name: _ends(_stepper(env, settings), state, controls) for name, settings in _ENDS.items()}
            advance(1)
            steppers = {name: _stepper(env, SWEEP[name]) for name in COMPARED}
            ends = {name: _ends(step, state, controls) for name, step in steppers.items()}  # compiles too
            rates = {name: [] for name in COMPARED}
            for _ in range(options.runs):
                for name, step in steppers.items():
                    began = time.process_time()
                    _ends(step, state, controls)
                    rates[name].append(len(controls) * env.engine.substeps / (time.process_time() - began))
                    advance(1)
            figures[grasp] = {
                name: Figures(float(np.median(rates[name])), *_off(ends[name], solved)) for name in COMPARED
            }
    lines = _text(figures)
    content = {
        "options": {"worlds": options.worlds, "runs": options.runs},
        "shares": _SHARES,
        "grasps": {g: {name: dataclasses.asdict(row) for name, row in rows.items()} for g, rows in figures.items()},
    }
    files = write_report(options.out, "convergence", lines, SCHEMA, _PACKAGES, content)
    return [*lines, "", *(str(file) for file in files)]


def moments(env: TrackingEnv, worlds: int) -> tuple[PhysicsState, Float[jax.Array, "n u"]]:
    """States that worlds pass through under jumping targets, and the targets of the control step that follows each."""
    script = make_script(env, worlds)
    state = jax.jit(jax.vmap(env.start))(script.variant, script.frame).pipeline_state.physics
    step, states = jax.jit(jax.vmap(env.engine.step)), []
    for targets in script.controls:
        states.append(state)
        state = step(state, jnp.asarray(targets, jnp.float32))
    # The first control step has no solution of a step before to begin with, which training's hardly ever lack.
    joined = jax.tree.map(lambda *rows: jnp.concatenate(rows), *states[1:])
    return joined, jnp.asarray(np.concatenate(script.controls[1:]), jnp.float32)


def _stepper(env: TrackingEnv, settings: Settings) -> _Step:
    """Many worlds' control step with these settings."""
    engine = NativeEngine(settings.applied(env.engine.models), env.engine.substeps)
    return jax.jit(jax.vmap(engine.step))


def _ends(step: _Step, state: PhysicsState, controls: Float[jax.Array, "n u"]) -> Float[np.ndarray, "n q"]:
    """Where one control step leads."""
    return np.asarray(step(state, controls).qpos)


def _off(
    ends: Float[np.ndarray, "n q"], solved: Mapping[str, Float[np.ndarray, "n q"]]
) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """See `Figures`. The object's pose is the end of qpos, its position first; hinges come just before."""
    object_errors, hinges = {}, {}
    for name, end in solved.items():
        away = ends - end
        object_errors[name] = np.percentile(np.linalg.norm(away[:, -7:-4], axis=-1), _SHARES).tolist()
        hinges[name] = np.percentile(np.abs(away[:, -7 - NUM_HINGES : -7]).max(axis=-1), _SHARES).tolist()
    return object_errors, hinges


def _text(figures: Mapping[str, Mapping[str, Figures]]) -> list[str]:
    lines = [
        "## One control step of training",
        "",
        *machine(*_PACKAGES),
        "",
        "*Speed*: physics steps a second of CPU time, the first row's being 1. Then how far the object ends from where",
        "1000 sweeps have it, and how far it and the worst hinge end from where Newton's method, run to its end, has",
        "them: at the median, for 90 and for 99 of 100 control steps.",
    ]
    for grasp, rows in figures.items():
        lines += [
            "",
            f"### {grasp}",
            "",
            "| settings | speed | thousands a second | object from 1000 sweeps, µm | from Newton's, µm "
            "| hinges from Newton's, ° |",
            "|---|---:|---:|---:|---:|---:|",
        ]
        for name, row in rows.items():
            cells = (
                f"{row.steps / rows[CHOSEN].steps:.2f}",
                f"{row.steps / 1e3:.0f}",
                *(" / ".join(f"{1e6 * off:.1f}" for off in row.object_off[end]) for end in _ENDS),
                " / ".join(f"{np.rad2deg(off):.2f}" for off in row.hinges_off["Newton's"]),
            )
            lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines
