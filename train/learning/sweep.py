"""Sweeps: one task over all combinations of values, `config=pinch,power seed=0,1,2`, through Hydra's launchers.

    python -m train.ppo --multirun config=pinch,power seed=0,1,2                         # one after the other
    python -m train.ppo --multirun ... hydra/launcher=joblib hydra.launcher.n_jobs=4     # processes of this machine
    python -m train.ppo --multirun ... hydra/launcher=submitit_slurm                     # jobs of a Slurm cluster

Each job has its own `out` folder. One that fails is reported and leaves the others alone; given again, the same
command goes on with what is not finished.
"""

import contextlib
import dataclasses
import importlib
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import hydra
from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException, MissingConfigException
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException
from rich.console import Console
from rich.table import Table

from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError
from train.learning.interruption import left_to_others
from train.settings.config import Config, command, compose, one_line, refuse, to_config
from train.settings.device import use_device
from train.settings.overrides import completed

LOG = "log.txt"
_FLAGS = {"-m", "--multirun"}
_stopped = 0  # the signal that stopped a job of this process, after which it starts no other


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What came of one job.

    Attributes:
        config: the job's.
        result: what its task returned.
        wrong: why there is no result, in a line.
        stopped: the exit status of a job that a signal stopped, or that one kept from starting; else 0.
    """

    config: Config
    result: Mapping[str, object] = dataclasses.field(default_factory=dict)
    wrong: str = ""
    stopped: int = 0


@dataclasses.dataclass(frozen=True)
class _Job:
    """A task by its name, so that another process can import it."""

    module: str
    name: str

    def __call__(self, composed: DictConfig) -> Outcome:
        global _stopped
        config = to_config(composed)
        if _stopped:
            return Outcome(config, wrong="not started", stopped=_stopped)
        task = getattr(importlib.import_module(self.module), self.name)
        enable_compile_cache()
        try:
            use_device(config.device, config.distributed)
            with _log_of(config):
                return Outcome(config, task(config) or {})
        except SystemExit as stop:
            _stopped = stop.code if isinstance(stop.code, int) else 1
            return Outcome(config, wrong="stopped", stopped=_stopped)
        except InputError as error:
            return Outcome(config, wrong=str(error))
        except Exception as error:  # whatever it is, the other jobs go on
            return Outcome(config, wrong=f"{type(error).__name__}: {error}".splitlines()[0])


def sweepable_command(task: Callable[[Config], Mapping[str, object] | None]) -> None:
    """`command`, which with `--multirun` runs the task once for each combination of values."""
    arguments = sys.argv[1:]
    flags = {argument for argument in arguments if argument.startswith("-")}
    if not flags or not flags <= _FLAGS:
        command(task)
        return
    try:
        sys.exit(sweep(task, [argument for argument in arguments if argument not in flags]))
    except InputError as error:
        refuse(error)


def sweep(task: Callable[[Config], Mapping[str, object] | None], overrides: Sequence[str]) -> int:
    """Run `task`, a function at the top of a module, for all combinations; print a table; the exit status.

    Raises:
        InputError: a job's options cannot be used, or two jobs share a folder; nothing was started then.
    """
    configs = combinations(overrides)
    _check_folders(configs)
    outcomes = _launched(_Job(_module(task), task.__name__), overrides)
    Console().print(table(outcomes))
    stopped = max(outcome.stopped for outcome in outcomes)
    if stopped:
        print("the sweep was stopped; the same command goes on from there", flush=True)
    return stopped or int(any(outcome.wrong for outcome in outcomes))


def combinations(overrides: Sequence[str]) -> list[Config]:
    """The configuration of every job, in the order in which they start.

    Raises:
        InputError: whatever `compose` refuses, or values that cannot be listed.
    """
    ours = [override for override in overrides if not override.lstrip("+~").startswith("hydra")]
    try:
        (jobs,) = BasicSweeper.split_arguments(OverridesParser.create().parse_overrides(ours), None)
    except HydraException as error:
        raise InputError(one_line(error)) from None
    return [compose(job) for job in jobs]


def table(outcomes: Sequence[Outcome]) -> Table:
    """One row per job: its name and seed, and what its task returned or why it did not."""
    columns = list(dict.fromkeys(name for outcome in outcomes for name in outcome.result))
    wrong = any(outcome.wrong for outcome in outcomes)
    made = Table("name", "seed", "folder", *columns, *(["what went wrong"] if wrong else []))
    for outcome in outcomes:
        values = [str(outcome.result.get(name, "")) for name in columns]
        config = outcome.config
        made.add_row(config.name, str(config.seed), config.out, *values, *([outcome.wrong] if wrong else []))
    return made


def _launched(job: _Job, overrides: Sequence[str]) -> list[Outcome]:
    elsewhere = any(override.startswith("hydra/launcher=") for override in overrides)
    try:
        with (
            hydra.initialize_config_module("configs", version_base=None),
            left_to_others() if elsewhere else contextlib.nullcontext(),
        ):
            running: Any = GlobalHydra.instance().hydra
            batches = running.multirun("train", job, completed(overrides))
    except MissingConfigException as error:
        hint = "; launchers come with: pip install 'mjx-hand[sweep]'" if elsewhere else ""
        raise InputError(one_line(error) + hint) from None
    except (HydraException, OmegaConfBaseException) as error:
        raise InputError(one_line(error)) from None
    except Exception as error:  # a worker that was killed, a cluster that did not take a job
        raise InputError(
            f"the launcher gave up ({str(error).splitlines()[0]}); the same command goes on from what the jobs saved"
        ) from None
    return [returned.return_value for batch in batches for returned in batch]


def _check_folders(configs: Sequence[Config]) -> None:
    first: dict[Path, int] = {}
    for k, config in enumerate(configs):
        if config.distributed.processes > 1:
            raise InputError("a sweep's jobs are one process each; leave out distributed.processes, or --multirun")
        other = first.setdefault(Path(config.out), k)
        if other != k:
            raise InputError(
                f"jobs {other} and {k} of the sweep would both write to {config.out}; name a folder for each, such as "
                "'out=outputs/${name}/lr${ppo.learning_rate}-seed${seed}'"
            )


def _module(task: Callable[..., object]) -> str:
    """The module that a task can be imported from, also where that is being run as a program."""
    if task.__module__ != "__main__":
        return task.__module__
    spec = sys.modules["__main__"].__spec__
    if spec is None:
        raise InputError("a sweep needs an entry point that is run as a module: python -m train.ppo")
    return spec.name


@contextlib.contextmanager
def _log_of(config: Config) -> Iterator[None]:
    """A context in which a job that others run beside writes what it says to `out/log.txt`."""
    if HydraConfig.get().runtime.choices["hydra/launcher"] == "basic":
        print(f"\n== {config.out}", flush=True)
        yield
        return
    path = Path(config.out) / LOG
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as log, contextlib.redirect_stdout(log), contextlib.redirect_stderr(log):
        try:
            yield
        except Exception:
            traceback.print_exc()
            raise
