"""`python -m train.benchmark gpu`: all that a GPU's few minutes can tell, the most telling first.

Warp's agreement and speed come first, and beside them the scene of a peer; then learning, which is what speed is for;
then the host, mixed with the GPU or alone. MJX, which compiles for minutes and is no engine for a GPU's training, comes
late. What is left goes to one policy for all grasp types.
"""

import contextlib
import dataclasses
import functools
import os
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from envs.demonstrations.dataset import make_set
from mjx_hand.errors import InputError
from mjx_hand.progress import shares
from train.benchmark.engines import config
from train.benchmark.gpu import device, host, learning, peer, physics
from train.benchmark.gpu.bench import Bench, measured_engine
from train.benchmark.gpu.budget import Budget
from train.benchmark.gpu.page import Pages, text
from train.benchmark.gpu.record import Record
from train.benchmark.gpu.scale import FULL, REHEARSAL, Scale, gpu_config
from train.benchmark.gpu.stages import Stage, run_stages
from train.reports.machine import accelerator

_GRACE = 25.0  # seconds after the end, in which what cannot be interrupted (a compiler) may end by itself


@dataclasses.dataclass(frozen=True)
class Options:
    """Measure engines and training on the GPU here within some minutes; each stage's results are written as it ends.

    Attributes:
        minutes: that all stages together may take.
        rehearse: run the stages at tiny size, on whatever is here; mjx, which compiles for minutes, where it is named.
        prepare: make the demonstration sets that the stages need, on any machine, and measure nothing.
        stages: which to run; all if none is named.
        out: folder for gpu.md, gpu.json, plots and trained policies.
        demonstrations: folder below which demonstration sets are kept, and made where missing.
    """

    minutes: float = 9.0
    rehearse: bool = False
    prepare: bool = False
    stages: tuple[str, ...] = ()
    out: Path = Path("outputs/benchmark/gpu")
    demonstrations: Path = Path("outputs/demonstrations")


def report(options: Options) -> list[str]:
    """Measure, and return the lines of the report, which the folder holds as well.

    Raises:
        InputError: no GPU, options out of range, or a folder that cannot be written.
        SystemExit: it was interrupted (status 128 and the signal's number); what was measured is kept.
    """
    if not options.minutes > 0:
        raise InputError(f"minutes is {options.minutes:g}; give more than 0")
    scale = REHEARSAL if options.rehearse else FULL
    if options.prepare:
        return _prepared(scale, options.demonstrations)
    if not options.rehearse and accelerator() is None:
        raise InputError(
            "JAX has no GPU here; on a machine that has one, install its CUDA version with: pip install "
            "'mjx-hand[cuda]', or try all stages at tiny size with --rehearse"
        )
    bench = Bench(scale, Budget.of(options.minutes), measured_engine(), options.out, options.demonstrations)
    chosen = _chosen(stages(bench), options.stages, scale.by_name)
    pages = Pages(options.out, {"minutes": options.minutes, "rehearse": options.rehearse, "engine": bench.engine})
    with (
        contextlib.redirect_stdout(sys.stderr),  # progress; the report alone goes to standard output
        _interruptible(),
        _ending(60 * options.minutes + _GRACE),
    ):
        records = run_stages(chosen, bench.budget, pages, bench.say)
    return [*text(records), "", str(options.out / "gpu.md"), str(options.out / "gpu.json")]


def stages(bench: Bench) -> list[Stage]:
    """All stages, in order."""
    scale, engine = bench.scale, bench.engine

    def stage(name: str, title: str, needs: float, run: Any) -> Stage:
        return Stage(name, title, needs * scale.patience, run)

    def machine(record: Record, keep: Any) -> None:
        device.describe(record)

    def ppo(record: Record, keep: Any) -> None:
        table = record.table(*learning.SPEED_COLUMNS)
        learning.speed(bench, engine, engine, scale.ppo_worlds, table)

    def mjx(record: Record, keep: Any) -> None:
        physics.sweep(bench, "mjx", scale.mjx_worlds, record, keep)
        if bench.enough(record, "agreement", 60 * scale.patience):
            physics.agreement(bench, "mjx", record, keep)

    one, several = scale.trainings
    agree, sweep = (functools.partial(measure, bench, engine) for measure in (physics.agreement, physics.sweep))
    learn, longer = (
        functools.partial(learning.to_success, bench, several, "learn-several", further=f) for f in (False, True)
    )
    return [
        stage("machine", "Machine", 2.0, machine),
        stage("agreement", f"{engine} beside MuJoCo's C engine", 30.0, agree),
        stage("physics", f"Physics of {engine}", 40.0, functools.partial(sweep, scale.worlds)),
        stage("peer", "A peer's scene: Newton's cube in an Allegro hand", 45.0, functools.partial(peer.allegro, bench)),
        stage("ppo", f"Training's speed on {engine}", 40.0, ppo),
        stage("learn", f"Until {one} is learned", 60.0, functools.partial(learning.to_success, bench, one, "learn")),
        stage(
            "host",
            "Native physics, alone and with the learner on the GPU",
            40.0,
            functools.partial(host.on_host, bench),
        ),
        stage("learn-several", f"Until {several} is learned", 60.0, learn),
        stage("mjx", "Physics of mjx", 60.0, mjx),
        stage("long", f"On with {several} to {scale.long_steps:,} steps", 40.0, longer),
    ]


def _prepared(scale: Scale, root: Path) -> list[str]:
    """The folders of the demonstration sets, made where missing."""
    settings = [config("native", grasp, root).data for grasp in dict.fromkeys(("pinch", *scale.grasps))]
    for name in dict.fromkeys(scale.trainings):
        settings += gpu_config(name, scale, root, root).data.expand_types()
    with contextlib.redirect_stdout(sys.stderr), shares() as report_share:
        return [str(make_set(one, root, report_share)) for one in dict.fromkeys(settings)]


def _chosen(every: list[Stage], names: tuple[str, ...], by_name: tuple[str, ...]) -> list[Stage]:
    known = [stage.name for stage in every]
    for name in names:
        if name not in known:
            raise InputError(f"stage {name!r} is not known; valid: {', '.join(known)}")
    return [stage for stage in every if stage.name in (names or set(known) - set(by_name))]


@contextlib.contextmanager
def _interruptible() -> Iterator[None]:
    """A context that Ctrl-C and a polite kill end with a status that says so, whatever they interrupt."""

    def leave(number: int, frame: Any) -> None:
        raise SystemExit(128 + number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, leave) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def _ending(seconds: float) -> Iterator[None]:
    """A context that ends the process after so many seconds, even within a compiler; all that was kept stays."""

    def end() -> None:
        print("benchmark: out of time; what was measured is kept", file=sys.stderr, flush=True)
        os._exit(1)

    timer = threading.Timer(seconds, end)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
