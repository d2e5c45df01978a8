"""The typed configuration of an experiment, composed by Hydra from `configs/`, checked before anything is compiled."""

import dataclasses
import difflib
import sys
from collections.abc import Callable, Sequence
from typing import Any

import hydra
from hydra.core.config_store import ConfigStore
from hydra.errors import HydraException
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from envs.demonstrations.dataset import SetSettings
from envs.physics import ENGINES
from envs.task import Task
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError
from train.options import Checks, Debug, Distributed, Play, Ppo


@dataclasses.dataclass(frozen=True)
class Config:
    """An experiment.

    Attributes:
        name: of the experiment.
        engine: auto, native, mjx or warp.
        seed: of networks, resets and actions.
        out: folder for checkpoints, logs and results.
        demonstrations: folder below which demonstration sets are kept, and made where missing.
        checkpoint: what to evaluate or play; empty for the best of `out`.
        data: which demonstrations.
        task: what an episode is.
        ppo: how to learn.
        checks: evaluation while training.
        fresh: start anew although `out` holds a training to go on from.
        distributed: several processes.
        debug: help with what goes wrong.
        play: what to show.
    """

    name: str = "pinch"
    engine: str = "auto"
    seed: int = 0
    out: str = "outputs/${name}/seed${seed}"
    demonstrations: str = "outputs/demonstrations"
    checkpoint: str = ""
    data: SetSettings = dataclasses.field(default_factory=lambda: SetSettings(grasp="pinch"))
    task: Task = dataclasses.field(default_factory=Task)
    ppo: Ppo = dataclasses.field(default_factory=Ppo)
    checks: Checks = dataclasses.field(default_factory=Checks)
    fresh: bool = False
    distributed: Distributed = dataclasses.field(default_factory=Distributed)
    debug: Debug = dataclasses.field(default_factory=Debug)
    play: Play = dataclasses.field(default_factory=Play)

    def __post_init__(self):
        if self.engine not in ("auto", *ENGINES):
            raise InputError(f"engine is {self.engine!r}; valid: auto, {', '.join(ENGINES)}")


def compose(overrides: Sequence[str] = ()) -> Config:
    """The configuration that these command-line overrides give.

    Raises:
        InputError: an unknown key, experiment or value, naming the valid ones.
    """
    _store_schema()
    try:
        with hydra.initialize_config_module("configs", version_base=None):
            base = hydra.compose("train", [o for o in overrides if o.startswith("config=")])
            for override in overrides:
                _check_key(base, override.split("=", 1)[0].lstrip("+~"))
            return to_config(hydra.compose("train", list(overrides)))
    except (HydraException, OmegaConfBaseException) as error:
        raise InputError(_one_line(error)) from None


def to_config(composed: DictConfig) -> Config:
    """The composed configuration as checked dataclasses."""
    return _made(Config, OmegaConf.to_container(composed, resolve=True, throw_on_missing=True))


def _made(cls: Any, values: Any) -> Any:
    """A dataclass from nested dictionaries. Configuration files have lists where frozen dataclasses have tuples."""
    given = {}
    for field in dataclasses.fields(cls):
        if field.name in values:
            value = values[field.name]
            if isinstance(value, dict):
                value = _made(field.type, value)
            given[field.name] = tuple(value) if isinstance(value, list) else value
    return cls(**given)


def command(task: Callable[[Config], object]) -> None:
    """Run `task` with the configuration of this process's arguments; Hydra's own flags (`--cfg job`) work too.

    Input that cannot be used ends the process with one line and status 2.
    """

    def job(composed: DictConfig) -> None:
        try:
            task(to_config(composed))
        except InputError as error:
            _refuse(error)

    _store_schema()
    enable_compile_cache()
    arguments = sys.argv[1:]
    if not any(argument.startswith("-") for argument in arguments):
        try:
            compose(arguments)
        except InputError as error:
            _refuse(error)
    hydra.main(version_base=None, config_path="pkg://configs", config_name="train")(job)()


def _refuse(error: InputError) -> None:
    print(f"train: {error}", file=sys.stderr)
    sys.exit(2)


def _store_schema() -> None:
    schema = OmegaConf.structured(Config)
    _make_writable(schema)  # frozen dataclasses make read-only nodes, which overrides could not change
    ConfigStore.instance().store(name="schema", node=schema)


def _make_writable(node: Any) -> None:
    if isinstance(node, DictConfig):
        OmegaConf.set_readonly(node, False)
        for name in node:
            _make_writable(node._get_node(name))
    elif isinstance(node, ListConfig):
        OmegaConf.set_readonly(node, False)
        for index in range(len(node)):
            _make_writable(node._get_node(index))


def _check_key(base: DictConfig, key: str) -> None:
    if key == "config" or key.startswith("hydra"):
        return
    node: Any = base
    parts = key.split(".")
    for depth, part in enumerate(parts):
        valid = [str(k) for k in node] if isinstance(node, DictConfig) else []
        if part not in valid:
            where = ".".join(parts[:depth])
            near = difflib.get_close_matches(part, valid, n=1)
            hint = f"; did you mean {'.'.join([*parts[:depth], near[0]])}?" if near else ""
            raise InputError(
                f"{key!r} is not an option{hint}"
                + (f"; valid {'in ' + where if where else 'options'}: {', '.join(valid)}" if valid else "")
            )
        node = node[part]


def _one_line(error: Exception) -> str:
    """What Hydra or OmegaConf says, without its search paths and types; the cause says more than the wrapper."""
    text = str(error.__cause__ or error).split("Config search path")[0]
    lines = [line.strip().rstrip(":") for line in text.splitlines() if line.strip()]
    return "; ".join(line for line in lines if not line.startswith(("object_type", "reference_type")))
