"""The typed configuration of an experiment, composed by Hydra from `configs/`, checked before anything is compiled."""

import contextlib
import dataclasses
import difflib
import io
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import hydra
from hydra._internal.utils import get_args_parser
from hydra.core.config_store import ConfigStore
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from envs.demonstrations.load_set import EVERY_PART
from envs.demonstrations.set_settings import SetSettings
from envs.disturbances.randomize import Randomize
from envs.physics import ENGINES
from envs.settings import from_dict
from envs.task import Task
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError, reason_of
from mjx_hand.robots.robot_hand import load_robot
from train.settings.device import DEVICES, use_device
from train.settings.options import Checks, Debug, Distributed, Export, Play, Ppo
from train.settings.overrides import completed, old_names, options_given
from train.settings.teleoperation import check_teleoperation

_SEEDS = 2**31  # JAX's keys are made of 32 bits, with a sign
Settled = Callable[["Config", Sequence[str]], "Config"]

# In `out`: a robot hand's results go to a folder of their own, in sweeps over hands too.
OmegaConf.register_new_resolver("of_robot", lambda hand: "" if hand == HUMAN else f"-{Path(hand).stem}", replace=True)
# For settings that were measured to differ.
OmegaConf.register_new_resolver(
    "human_or_robot", lambda hand, human, robot: human if hand == HUMAN else robot, replace=True
)


@dataclasses.dataclass(frozen=True)
class Config:
    """An experiment.

    Attributes:
        name: of the experiment.
        engine: auto, native, mjx or warp; auto picks by the device (docs/training.md).
        hand: human, a robot hand's name (docs/robots.md), or the path of its description.
        device: cpu or gpu: what JAX computes on, and with it how many worlds (`configs/device`).
        seed: of networks, resets and actions.
        seeds: for commands that take several seeds of one experiment; empty for `seed` alone.
        out: folder for checkpoints, logs and results.
        demonstrations: folder below which demonstration sets are kept.
        checkpoint: what to evaluate or play; empty for the best of `out`.
        part: of the demonstrations that evaluations are of: heldout, sealed (what nothing is tuned on) or train.
        data: which demonstrations; `data.folder=PATH` alone for finished ones.
        task: what an episode is.
        randomize: what disturbs training's episodes.
        ppo: how to learn.
        checks: evaluation while training.
        fresh: start anew although `out` holds a training to go on from.
        distributed: several processes.
        debug: help with what goes wrong.
        stress: whether evaluations test the policy under disturbances as well.
        play: what to show.
        export: what to write for other programs.
    """

    name: str = "pinch"
    engine: str = "auto"
    hand: str = HUMAN
    device: str = "cpu"
    seed: int = 0
    seeds: tuple[int, ...] = ()
    out: str = "outputs/${name}${of_robot:${hand}}/seed${seed}"
    demonstrations: str = "outputs/demonstrations"
    checkpoint: str = ""
    part: str = "heldout"
    data: SetSettings = dataclasses.field(default_factory=lambda: SetSettings(grasp="pinch"))
    task: Task = dataclasses.field(default_factory=Task)
    randomize: Randomize = dataclasses.field(default_factory=lambda: Randomize(share=1.0))
    ppo: Ppo = dataclasses.field(default_factory=Ppo)
    checks: Checks = dataclasses.field(default_factory=Checks)
    fresh: bool = False
    distributed: Distributed = dataclasses.field(default_factory=Distributed)
    debug: Debug = dataclasses.field(default_factory=Debug)
    stress: bool = False
    play: Play = dataclasses.field(default_factory=Play)
    export: Export = dataclasses.field(default_factory=Export)

    def __post_init__(self):
        if self.engine not in ("auto", *ENGINES):
            raise InputError(f"engine is {self.engine!r}; valid: auto, {', '.join(ENGINES)}")
        if self.hand != HUMAN:
            load_robot(self.hand)
        if self.part not in EVERY_PART:
            raise InputError(f"part is {self.part!r}; valid: {', '.join(EVERY_PART)}")
        if not self.out.strip():
            raise InputError("out is empty; give the folder to write to, such as out=outputs/pinch/seed0")
        for seed in (self.seed, *self.seeds):
            if not 0 <= seed < _SEEDS:
                raise InputError(f"seed is {seed}; valid: 0 to {_SEEDS - 1}")
        if self.device not in DEVICES:
            raise InputError(f"device is {self.device!r}; valid: auto, {', '.join(DEVICES)}")
        check_teleoperation(self.task, self.ppo, self.data, self.hand)


def compose(overrides: Sequence[str] = ()) -> Config:
    """The configuration that these command-line overrides give.

    Raises:
        InputError: an unknown key, experiment or value, naming the valid ones; or `seeds`.
    """
    return to_config(_composed(overrides))


def compose_seeds(overrides: Sequence[str] = ()) -> list[Config]:
    """The configuration of each of `seeds`, as `expand_seeds`.

    Raises:
        InputError: as `compose` and `expand_seeds`.
    """
    return expand_seeds(_composed(overrides))


def _composed(overrides: Sequence[str]) -> DictConfig:
    _store_schema()
    overrides = completed(overrides)
    try:
        with hydra.initialize_config_module("configs", version_base=None):
            base = hydra.compose("train", [o for o in overrides if o.startswith(("config=", "device="))])
            for override in overrides:
                _check_key(base, override.split("=", 1)[0].lstrip("+~"))
            return hydra.compose("train", list(overrides))
    except InputError:
        raise
    except Exception as error:  # numbers and brackets that Python itself gives up on are not Hydra's own errors
        raise InputError(one_line(error)) from None


def expand_seeds(composed: DictConfig) -> list[Config]:
    """A configuration for each of `seeds`, or for `seed` alone where they are empty; `out` follows the seed.

    Raises:
        InputError: a seed given twice, or an `out` or a `checkpoint` that is the same for several seeds.
    """
    seeds = list(composed.seeds or [composed.seed])
    configs = []
    for seed in seeds:
        one = composed.copy()
        one.seed, one.seeds = seed, []
        configs.append(to_config(one))
    if len(set(seeds)) < len(seeds):
        raise InputError(f"seeds is {seeds}; give each seed once")
    if len({config.out for config in configs}) < len(configs):
        raise InputError(
            f"out is {configs[0].out} for every seed; put ${{seed}} into it: out='{composed.out}/seed${{seed}}'"
        )
    if len(configs) > 1 and composed.checkpoint:
        raise InputError("checkpoint=FILE is one seed's policy; leave out seeds=..., or checkpoint=... for their best")
    return configs


def to_config(composed: DictConfig) -> Config:
    """The composed configuration as checked dataclasses.

    Raises:
        InputError: a value that cannot be used, a reference (`${...}`) to nothing or to itself, or `seeds`, which are
            not one configuration.
    """
    if composed.seeds:
        raise InputError(f"seeds is {list(composed.seeds)}, but this takes one seed; give it alone, such as seed=0")
    try:
        values = OmegaConf.to_container(composed, resolve=True, throw_on_missing=True)
    except (OmegaConfBaseException, RecursionError) as error:
        raise InputError(one_line(error)) from None
    return from_dict(Config, values)


def command(task: Callable[[Config], object], settled: Settled | None = None) -> None:
    """Run `task` with the configuration of this process's arguments; Hydra's own flags (`--cfg job`) work too.

    Input that cannot be used ends the process with one line and status 2.

    Args:
        task: what to do.
        settled: makes of a composed configuration, and the options that were given, the one to use.
    """
    _command(lambda composed, given: task(_on_device(_settled(to_config(composed), given, settled))))


def command_with_seeds(task: Callable[[Sequence[Config]], object], settled: Settled | None = None) -> None:
    """Like `command`, for a task that takes the configurations of several seeds (`seeds=[0,1,2]`)."""
    _command(
        lambda composed, given: task([_on_device(_settled(one, given, settled)) for one in expand_seeds(composed)])
    )


def _settled(config: Config, given: Sequence[str], settled: Settled | None) -> Config:
    return config if settled is None else settled(config, given)


def _on_device(config: Config) -> Config:
    use_device(config.device, config.distributed)
    return config


def _command(task: Callable[[DictConfig, Sequence[str]], object]) -> None:
    arguments = sys.argv[1:]

    def job(composed: DictConfig) -> None:
        try:
            task(composed, options_given(arguments))
        except InputError as error:
            refuse(error)
        except OSError as error:  # a path that the system cannot use: too long a name, no permission, a full disk
            refuse(InputError(error))

    _store_schema()
    enable_compile_cache()
    for old, new in old_names(arguments).items():
        print(f"train: {old} is called {new} now", file=sys.stderr)
    try:
        _check_flags(arguments)
        if not any(argument.startswith("-") for argument in arguments):
            expand_seeds(_composed(arguments))
        sys.argv[1:] = completed(arguments)
    except InputError as error:
        refuse(error)
    hydra.main(version_base=None, config_path="pkg://configs", config_name="train")(job)()


def _check_flags(arguments: Sequence[str]) -> None:
    """Raise InputError for flags that Hydra does not have: it would print all of those that it has."""
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            get_args_parser().parse_args(list(arguments))
    except SystemExit as end:
        if not end.code:
            raise
        reason = (said.getvalue().strip().splitlines() or [""])[-1].partition("error: ")[2]
        raise InputError(f"{reason or 'these flags are not known'}; options are written name=value") from None


def refuse(error: InputError) -> None:
    """End the process with one line and status 2."""
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
    if key in ("config", "device") or key.startswith("hydra"):
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


def one_line(error: Exception) -> str:
    """What Hydra or OmegaConf says, without its search paths and types; the cause says more than the wrapper."""
    text = str(error.__cause__ or error).split("Config search path")[0]
    lines = [line.strip().rstrip(":") for line in text.splitlines() if line.strip()]
    shown = [line for line in lines if not line.startswith(("object_type", "reference_type"))]
    return "; ".join(shown) or f"these options cannot be read ({reason_of(error)}); write them as name=value"
