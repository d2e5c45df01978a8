"""The typed configuration of an experiment, composed by Hydra from `configs/`, checked before anything is compiled."""

import dataclasses
import difflib
import math
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


@dataclasses.dataclass(frozen=True)
class Ppo:
    """Proximal policy optimisation (Schulman et al. 2017), as `brax.training.agents.ppo` has it.

    Attributes:
        num_timesteps: control steps of all worlds together.
        num_envs: worlds in parallel; a multiple of num_minibatches.
        unroll_length: steps of each world between updates.
        num_minibatches, num_updates_per_batch: gradient steps an update are their product.
        learning_rate, entropy_cost, discounting, gae_lambda, clipping_epsilon, max_grad_norm: as usual.
        policy_layers, value_layers: hidden layer sizes.
        initial_std: standard deviation of actions at first; a residual of 1 is the task's full range.
    """

    num_timesteps: int = 1_000_000
    num_envs: int = 256
    unroll_length: int = 16
    num_minibatches: int = 8
    num_updates_per_batch: int = 4
    learning_rate: float = 3e-4
    entropy_cost: float = 3e-4
    discounting: float = 0.97
    gae_lambda: float = 0.95
    clipping_epsilon: float = 0.2
    max_grad_norm: float = 1.0
    policy_layers: tuple[int, ...] = (128, 128)
    value_layers: tuple[int, ...] = (256, 256)
    initial_std: float = 0.4

    def __post_init__(self):
        for name in ("policy_layers", "value_layers"):
            if any(size < 1 for size in getattr(self, name)):
                raise InputError(f"ppo.{name} is {list(getattr(self, name))}; every layer needs at least 1 unit")
        whole = ("num_timesteps", "num_envs", "unroll_length", "num_minibatches", "num_updates_per_batch")
        for name in (*whole, "learning_rate", "clipping_epsilon", "max_grad_norm", "initial_std"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"ppo.{name} is {getattr(self, name)}; it must be a number above 0")
        if not 0 <= self.entropy_cost < math.inf:
            raise InputError(f"ppo.entropy_cost is {self.entropy_cost}; it must be a number that is not negative")
        for name in ("discounting", "gae_lambda"):
            if not 0 < getattr(self, name) <= 1:
                raise InputError(f"ppo.{name} is {getattr(self, name)}; it must be above 0 and at most 1")
        if self.num_envs % self.num_minibatches:
            raise InputError(
                f"ppo.num_envs is {self.num_envs}, not a multiple of ppo.num_minibatches ({self.num_minibatches}); "
                f"give for example {max(self.num_envs // self.num_minibatches, 1) * self.num_minibatches}"
            )


@dataclasses.dataclass(frozen=True)
class Checks:
    """Evaluation while training, on the training demonstrations from frame 0, unassisted.

    Attributes:
        every: control steps between evaluations; the best policy so far is kept.
        stop_at: stop once this share succeeds (ManipTrans object); above 1, never.
    """

    every: int = 100_000
    stop_at: float = 2.0

    def __post_init__(self):
        if self.every < 1:
            raise InputError(f"checks.every is {self.every}; it must be at least 1 step")
        if math.isnan(self.stop_at):
            raise InputError("checks.stop_at is nan; give a share such as 0.97, or 2 to never stop early")


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
