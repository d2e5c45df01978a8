"""`python -m train.benchmark mjbatch`: the native engine beside mjbatch, on the same worlds, threads and settings.

mjbatch (Apache-2.0) is a package that steps batches of MuJoCo's worlds on a CPU. It needs a MuJoCo of another version,
so it runs in an environment of its own, which is told by pipe when its turn is. Both step pinches of several hands
under the demonstrations' targets with random residuals. A round has a short run of each, so that what is said of one
beside the other holds on a machine whose speed drifts.

Sensors of mjbatch, as of `mj_step`, are a substep behind the state, unless it ends each control step with all of
`mj_forward`; the native engine's belong to the state. Both ways are measured, and of `mujoco.batch` too, which the
native engine stands on: its rows say what the way through JAX costs.
"""

import contextlib
import dataclasses
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from envs.physics import solver
from envs.physics.native import NativeEngine, cores
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from mjx_hand.progress import counter
from train.benchmark import entrants
from train.benchmark.contestants import PASS
from train.benchmark.engines import small_env
from train.benchmark.entrants import Entrant
from train.benchmark.exchange import make_start, write_scene, write_script
from train.benchmark.mjbatch_process import INSTALL, MjbatchProcess
from train.benchmark.mjbatch_report import Results, Row, text, write

_SETTINGS = {"PGS 15": solver.gauss_seidel, "Newton 10": solver.newton}


@dataclasses.dataclass(frozen=True)
class Options:
    """Measure the native engine beside mjbatch.

    Attributes:
        python: interpreter of an environment that mjbatch is installed in; without one mjbatch is left out.
        worlds: numbers of worlds in parallel.
        threads: that step worlds, of either; all cores if 0.
        rounds: timed runs of each.
        seconds: how long a run should last.
        out: folder for mjbatch.md and mjbatch.json.
        demonstrations: folder below which demonstration sets are kept, and made where missing.
    """

    python: Path | None = None
    worlds: tuple[int, ...] = (1, 16, 64, 256)
    threads: int = 0
    rounds: int = 21
    seconds: float = 0.2
    out: Path = Path("outputs/benchmark")
    demonstrations: Path = Path("outputs/demonstrations")


def report(options: Options) -> list[str]:
    """Measure, write the files, and return the lines of the report.

    Raises:
        InputError: for options out of range, an interpreter without mjbatch, or a folder that cannot be written.
    """
    _check(options)
    threads = options.threads or cores()
    notes, rows, versions = [], [], {}
    with (
        contextlib.redirect_stdout(sys.stderr),  # progress; the report alone goes to standard output
        contextlib.ExitStack() as stack,
    ):
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        process = None
        if options.python is None:
            notes.append(f"mjbatch: not measured; make an environment for it with: {INSTALL}")
        else:
            process = stack.enter_context(MjbatchProcess(options.python, folder))
            versions = process.versions
        env = small_env("native", "pinch", options.demonstrations)
        models = {name: setting(env.models) for name, setting in _SETTINGS.items()}
        write_scene(folder, env, models)
        advance = stack.enter_context(counter(len(models) * len(options.worlds) * options.rounds, "timing"))
        for name in models:
            engine = NativeEngine(models[name], env.engine.substeps, threads)
            for count in options.worlds:
                entered = list(_enter(env, engine, name, count, threads, process, folder, notes))
                spent = _rounds(entered, options.rounds, options.seconds, advance)
                ends = [entrant.end() for entrant in entered]
                steps = count * PASS * engine.substeps
                rows += Row.of_all(name, [e.name for e in entered], count, steps / spent, ends)
    results = Results(rows=rows, notes=list(dict.fromkeys(notes)), threads=threads, theirs=versions)
    lines = text(results)
    kept = {"worlds": options.worlds, "rounds": options.rounds, "seconds": options.seconds}
    files = write(results, lines, options.out, kept)
    return [*lines, "", *(str(file) for file in files)]


def _check(options: Options) -> None:
    if not options.worlds or min(options.worlds) < 1:
        raise InputError(f"worlds is {options.worlds}; give numbers of worlds, each at least 1, such as 1 64 256")
    if options.rounds < 1 or not options.seconds > 0:
        raise InputError(f"{options.rounds} rounds of {options.seconds:g} s; give at least 1, longer than 0 s")
    if options.threads < 0:
        raise InputError(f"threads is {options.threads}; give how many, or 0 for all {cores()} cores")


def _enter(
    env: TrackingEnv,
    engine: NativeEngine,
    setting: str,
    count: int,
    threads: int,
    process: MjbatchProcess | None,
    folder: Path,
    notes: list[str],
) -> Iterator[Entrant]:
    """All that step so many worlds under one setting."""
    start = make_start(env, count)
    yield entrants.native(engine, start)
    for current in (True, False):
        yield entrants.mujoco_batch(engine, start, threads, current)
    if process is None:
        return
    script = folder / f"{count} worlds.npz"
    write_script(script, start, engine.substeps)
    for current in (True, False):
        key = f"{setting}, {count} worlds, {'current' if current else 'late'}"
        paths = {"scene": "scene.xml", "numbers": f"{setting}.npz", "script": script.name}
        odd = process.ask(do="make", name=key, threads=min(threads, count), forward=current, **paths)
        for names, what in zip(odd, ("compiles otherwise, and is given", "does not know"), strict=True):
            if names:
                notes.append(f"numbers that mjbatch's MuJoCo {what}: {', '.join(names)}")
        yield entrants.mjbatch(process.ask, key, start, current)


def _rounds(entered: Sequence[Entrant], rounds: int, seconds: float, report: Callable[[int], None]) -> np.ndarray:
    """Seconds of wall and of CPU time a pass, of each entrant in each round: (entrants, rounds, 2)."""
    passes = [_enough_passes(entrant, seconds) for entrant in entered]
    spent = np.zeros((len(entered), rounds, 2))
    for k in range(rounds):
        for turn in range(len(entered)):
            i = (turn + k) % len(entered)  # who goes first changes, too
            spent[i, k] = np.divide(entered[i].run(passes[i]), passes[i])
        report(1)
    return spent


def _enough_passes(entrant: Entrant, seconds: float) -> int:
    """Passes that last about `seconds`; the first ones compile and warm up."""
    entrant.run(1)
    passes = 1
    while (took := entrant.run(passes)[0]) < seconds / 4:
        passes *= 2
    return max(round(passes * seconds / took), 1)
