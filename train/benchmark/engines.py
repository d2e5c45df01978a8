"""`python -m train.benchmark engines`: steps a second of each physics engine, and of MuJoCo's own ways beside them.

All work on the pinch scene. *environment* is what training steps: physics, rewards, observations and restarts under
random actions. *physics* is the engine alone. Each contestant runs once a round, so that the ratios hold on a machine
whose speed drifts.
"""

import contextlib
import dataclasses
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from envs.demonstrations.dataset import SetSettings
from envs.physics import ENGINES, default_engine
from envs.physics.native import cores
from mjx_hand.errors import InputError
from mjx_hand.view.progress import counter
from train.benchmark.contestants import Contestant, environment, open_rollout, physics, step_loop
from train.benchmark.engine_report import Results, Row, text, write
from train.benchmark.learning import Learning, measure_learning
from train.benchmark.machine import accelerator
from train.benchmark.timing import rates
from train.config import Config
from train.experiment import World, make_world

_DATA = SetSettings(grasp="pinch", people=1, heldout_people=1, trials=2)
_CPU_WORLDS, _ACCELERATOR_WORLDS = (1, 64, 256), (1, 256, 1024, 4096)


def _default_engines() -> tuple[str, ...]:
    """On a CPU, where `warp` is for finding faults and not for speed, all others; else all."""
    return tuple(name for name in ENGINES if name != "warp" or accelerator())


def _default_worlds() -> tuple[int, ...]:
    return _ACCELERATOR_WORLDS if accelerator() else _CPU_WORLDS


@dataclasses.dataclass(frozen=True)
class Options:
    """Measure how fast the physics engines step the pinch scene here.

    Attributes:
        engines: native, mjx, warp.
        worlds: numbers of worlds in parallel.
        runs: timed runs of each contestant, of which the median, least and greatest are given.
        seconds: how long a run should last.
        ppo: measure training as well, on the engine that training picks and the greatest number of worlds.
        out: folder for engines.json and engines.png.
        demonstrations: folder below which demonstration sets are kept, and made where missing.
    """

    engines: tuple[str, ...] = dataclasses.field(default_factory=_default_engines)
    worlds: tuple[int, ...] = dataclasses.field(default_factory=_default_worlds)
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
    engines, missing = split(options.engines)
    worlds = sorted(set(options.worlds))
    with contextlib.redirect_stdout(sys.stderr):  # progress; the report alone goes to standard output
        made = {
            name: make_world(config(name, options.demonstrations), "train")
            for name in dict.fromkeys((*engines, "native"))
        }
        entered = list(_enter(made, engines, worlds))
        with counter(options.runs * len(entered), "timing") as advance:
            measured = rates(entered, options.runs, options.seconds, advance)
        learning = _learning(options, made, entered) if options.ppo else None
    env = made["native"].env
    results = Results(
        rows=[Row.of(c, rate, env.dt, env.task.substeps) for c, rate in zip(entered, measured, strict=True)],
        learning=learning,
        missing=missing,
        substeps=env.task.substeps,
        dt=env.dt,
    )
    files = write(results, options.out, {k: getattr(options, k) for k in ("engines", "worlds", "runs", "seconds")})
    return [*text(results), "", *(str(file) for file in files)]


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


def split(engines: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Engines that are here, and how to install each of the others."""
    missing = {
        name: "not installed; install it with: pip install 'mjx-hand[warp]'"
        for name in engines
        if name == "warp" and find_spec("warp") is None
    }
    return [name for name in dict.fromkeys(engines) if name not in missing], missing


def config(engine: str, demonstrations: Path) -> Config:
    """The experiment that is measured: the pinch task on a set that is made in seconds."""
    return Config(name="benchmark", engine=engine, data=_DATA, demonstrations=str(demonstrations))


def _enter(made: Mapping[str, World], engines: Sequence[str], worlds: Sequence[int]) -> Iterator[Contestant]:
    """All contestants, compiled.

    MJX takes a minute to compile, so only two engines are measured alone: `native`, beside MuJoCo's own ways, and on
    the greatest number of worlds the one that training picks here.
    """
    native = made["native"].env
    for name in engines:
        for count in worlds:
            print(f"compiling {name}, environment, {count} worlds", flush=True)
            yield environment(made[name].env, count)
        alone = worlds if name == "native" else worlds[-1:] if name == default_engine() else []
        for count in alone:
            print(f"compiling {name}, physics, {count} worlds", flush=True)
            yield physics(made[name].env, count)
    yield step_loop(native)
    for count in worlds:
        yield open_rollout(native, count, cores())


def _learning(options: Options, made: Mapping[str, World], entered: Sequence[Contestant]) -> Learning:
    name = default_engine()
    alone = max((c for c in entered if (c.name, c.scope) == (name, "physics")), key=lambda c: c.worlds)
    print(f"training on {name}, {alone.worlds} worlds", flush=True)
    return measure_learning(config(name, options.demonstrations), made[name], alone, options.runs, options.seconds)
