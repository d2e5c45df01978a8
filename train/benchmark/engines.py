"""`python -m train.benchmark engines`: steps a second of each physics engine, and of MuJoCo's own ways beside them.

Each grasp type's scene is stepped by itself. *physics* is the engine alone, under the demonstrations' targets with
random residuals. *environment* is what training steps: physics, rewards, observations and restarts under random
actions. Of one type, each contestant runs once a round, so that the ratios hold on a machine whose speed drifts.
"""

import contextlib
import dataclasses
import functools
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from envs.demonstrations.dataset import make_missing_sets
from envs.demonstrations.set_settings import SetSettings
from envs.grasps import grasp_names, grasp_type
from envs.physics import ENGINES, default_engine
from envs.physics.native import cores
from envs.scene import TIMESTEP
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from mjx_hand.progress import counter
from train.benchmark.contestants import Contestant, environment, open_rollout, physics, step_loop
from train.benchmark.engine_report import Results, Row, text, write
from train.benchmark.learning import Learning, measure_learning
from train.benchmark.memory import fitting, with_memory
from train.benchmark.timing import rates
from train.experiment.setup import load_env
from train.reports.machine import accelerator
from train.settings.config import Config

_CPU_WORLDS, _ACCELERATOR_WORLDS = (1, 16, 64, 256), (1, 256, 1024, 4096)
_COMPILED_ON_CPU = "pinch"  # the one type of engines that take a minute to compile for each number of worlds


def _default_engines() -> tuple[str, ...]:
    """On a CPU, where `warp` is for finding faults and not for speed, all others; else all."""
    return tuple(name for name in ENGINES if name != "warp" or accelerator())


def _default_worlds() -> tuple[int, ...]:
    return _ACCELERATOR_WORLDS if accelerator() else _CPU_WORLDS


def _default_compiled() -> tuple[str, ...]:
    return () if accelerator() else (_COMPILED_ON_CPU,)


@dataclasses.dataclass(frozen=True)
class Options:
    """Measure how fast the physics engines step the scenes of the grasp types here.

    Attributes:
        grasps: the types; all if none is named.
        engines: native, mjx, warp.
        compiled: types that mjx and warp are measured on, where they take a minute to compile for each number of
            worlds; all if none is named.
        worlds: numbers of worlds in parallel.
        full: on an accelerator, go on doubling the greatest number of worlds until its memory is full.
        runs: timed runs of each contestant, of which the median, least and greatest are given.
        seconds: how long a run should last.
        ppo: measure training as well, on the engine that training picks and the greatest number of worlds.
        out: folder for engines.md, engines.json and engines.png.
        demonstrations: folder below which demonstration sets are kept, and made where missing.
    """

    grasps: tuple[str, ...] = ()
    engines: tuple[str, ...] = dataclasses.field(default_factory=_default_engines)
    compiled: tuple[str, ...] = dataclasses.field(default_factory=_default_compiled)
    worlds: tuple[int, ...] = dataclasses.field(default_factory=_default_worlds)
    full: bool = dataclasses.field(default_factory=lambda: accelerator() is not None)
    runs: int = 5
    seconds: float = 0.3
    ppo: bool = False
    out: Path = Path("outputs/benchmark")
    demonstrations: Path = Path("outputs/demonstrations")


def report(options: Options) -> list[str]:
    """Measure, write the files, and return the lines of the report.

    Raises:
        InputError: for options out of range, or a folder that cannot be written.
    """
    _check(options)
    grasps = [grasp_type(name).name for name in options.grasps or grasp_names()]
    compiled = [grasp_type(name).name for name in options.compiled or grasps]
    engines, notes = split(options.engines)
    notes += _left_out(engines, grasps, compiled)
    task = Task()
    rows, learning = [], []
    with contextlib.redirect_stdout(sys.stderr):  # progress; the report alone goes to standard output
        for grasp in grasps:
            here = [name for name in engines if name == "native" or grasp in compiled]
            environments = {
                name: small_env(name, grasp, options.demonstrations) for name in dict.fromkeys((*here, "native"))
            }
            entered = list(_enter(environments, here, options, notes))
            with counter(options.runs * len(entered), f"timing {grasp}") as advance:
                measured = rates(entered, options.runs, options.seconds, advance)
            rows += [
                Row.of(grasp, c, rate, environments["native"].dt, task.substeps)
                for c, rate in zip(entered, measured, strict=True)
            ]
            if options.ppo and default_engine() in here:
                learning.append(_learning(options, grasp, environments, entered))
    results = Results(rows=rows, learning=learning, notes=notes, substeps=task.substeps, dt=task.substeps * TIMESTEP)
    kept = ("grasps", "engines", "compiled", "worlds", "full", "runs", "seconds")
    lines = text(results)
    files = write(results, lines, options.out, {name: getattr(options, name) for name in kept})
    return [*lines, "", *(str(file) for file in files)]


def _check(options: Options) -> None:
    for name in options.engines:
        if name not in ENGINES:
            raise InputError(f"engine {name!r} is not known; valid: {', '.join(ENGINES)}")
    if not options.worlds or min(options.worlds) < 1:
        raise InputError(f"worlds is {options.worlds}; give numbers of worlds, each at least 1, such as 1 64 256")
    if options.runs < 1 or not options.seconds > 0:
        raise InputError(f"{options.runs} runs of {options.seconds:g} s; give at least 1 run, longer than 0 s")
    if options.ppo and default_engine() not in options.engines:
        raise InputError(f"ppo runs on engine {default_engine()} here; add it to the engines, or leave ppo out")


def split(engines: Sequence[str]) -> tuple[list[str], list[str]]:
    """Engines that are here, and a line on each of the others."""
    missing = [name for name in engines if name == "warp" and find_spec("warp") is None]
    return [name for name in dict.fromkeys(engines) if name not in missing], [
        f"{name}: not installed; install it with: pip install 'mjx-hand[warp]'" for name in missing
    ]


def _left_out(engines: Sequence[str], grasps: Sequence[str], compiled: Sequence[str]) -> list[str]:
    """A line on what is not measured, and why."""
    notes = []
    if not accelerator():
        notes.append("no accelerator: warp and GPU curves not measured")
    without = [name for name in grasps if name not in compiled]
    for name in engines:
        if name != "native" and without:
            notes.append(f"{name}: {', '.join(without)} left out, for the time it takes to compile (--compiled NAMES)")
    return notes


def config(engine: str, grasp: str, demonstrations: Path) -> Config:
    """The experiment that is measured: the type's task on a small set."""
    data = SetSettings(grasp=grasp, people=1, heldout_people=1, trials=2, heldout_trials=1)
    return Config(name="benchmark", engine=engine, data=data, demonstrations=str(demonstrations))


def small_env(engine: str, grasp: str, demonstrations: Path) -> TrackingEnv:
    """The environment of `config`; its set is made where it is missing."""
    measured = config(engine, grasp, demonstrations)
    make_missing_sets(measured.data, measured.demonstrations)
    return load_env(measured, "train")


def _enter(
    environments: Mapping[str, TrackingEnv], engines: Sequence[str], options: Options, notes: list[str]
) -> Iterator[Contestant]:
    """All contestants, compiled and run once. The environment is entered on the engine that training picks here."""
    worlds = sorted(set(options.worlds))
    for name in engines:
        env = environments[name]
        parts = [physics, environment] if name == default_engine() else [physics]
        for enter, scope in zip(parts, ("physics", "environment"), strict=False):
            for count in _counts(worlds, options.full and name != "native"):
                print(f"compiling {name}, {scope}, {count} worlds", flush=True)
                contestant = fitting(functools.partial(enter, env, count))
                if contestant is None:
                    notes.append(f"{name}, {scope}: {count:,} worlds do not fit into memory")
                    break
                yield contestant
    native = environments["native"]
    yield with_memory(functools.partial(step_loop, native))
    for count in worlds:
        yield with_memory(functools.partial(open_rollout, native, count, cores()))


def _counts(worlds: Sequence[int], full: bool) -> Iterator[int]:
    """The numbers of worlds, and if `full` the greatest doubled again and again."""
    yield from worlds
    count = worlds[-1]
    while full:
        count *= 2
        yield count


def _learning(
    options: Options, grasp: str, environments: Mapping[str, TrackingEnv], entered: Sequence[Contestant]
) -> Learning:
    name = default_engine()
    most = max(options.worlds)
    alone, around = (
        next(c for c in entered if (c.name, c.scope, c.worlds) == (name, scope, most))
        for scope in ("physics", "environment")
    )
    print(f"training {grasp} on {name}, {most} worlds", flush=True)
    composed = config(name, grasp, options.demonstrations)
    return measure_learning(composed, environments[name], alone, around, options.runs, options.seconds)
