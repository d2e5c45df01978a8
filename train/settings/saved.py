"""The settings that a run was made with, and whether others are the same.

A run's folder holds them in `config.yaml`, and so does each of its states; a policy holds those that it cannot do
without: what an episode is, the demonstrations, and the network. Told are dotted options and their values, as in
`task.grip_force`.
"""

import dataclasses
import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

from envs.demonstrations.load_set import part_digest
from envs.demonstrations.on_robot.robot_set import METHOD
from envs.grip_force import RECORDED
from envs.settings import from_dict
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import read_yaml
from train.settings.config import Config
from train.settings.overrides import RENAMED

FILE = "config.yaml"
# What may differ between a training and its continuation: places, and how long and how often.
_FREE = (
    "seeds",
    "out",
    "demonstrations",
    "checkpoint",
    "fresh",
    "distributed",
    "debug",
    "stress",
    "part",
    "play",
    "export",
    "checks",
    "data.folder",
    "data.sealed_people",
    "data.sealed_trials",
    "data.sealed_seed",
    "device",
    "ppo.num_updates",
    "ppo.num_timesteps",
)
_PLACES = ("demonstrations", "data.folder")  # taken from the run all the same where nothing else is given
_POLICY = ("name", "data", "hand", "task", "ppo.policy_layers")  # what a policy cannot do without
_RECORDING = ("data.recording",)  # of no account where the demonstrations are of no recording
_CONTENTS = "data.contents"  # digest of finished demonstrations
_REFERENCES = "data.robot_references"  # how a robot's come about, `robot_set.METHOD`
_FREE_OF_POLICY = ("engine", _REFERENCES)  # any engine may play it, after any references
_FOUND = (_CONTENTS, _REFERENCES)  # not given: what there is, or how this version makes it
# What runs were made with from before there were these options, where that is not the default that they came with.
_BEFORE = {"task.wrap_torque": 0.0}

Settings = Mapping[str, Any]


def settings_of(config: Config) -> Settings:
    """What must be the same for a training to go on, and what the finished demonstrations hold, wherever they are."""
    return {option: value for option, value in _relevant(_told(config)).items() if not _is(option, _FREE)}


def policy_settings(config: Config) -> Settings:
    """What must be the same for a policy to be scored."""
    told = _relevant(_told(config))
    free = (*_FREE, *_FREE_OF_POLICY)
    return {option: value for option, value in told.items() if _is(option, _POLICY) and not _is(option, free)}


def differing(before: Settings, now: Settings) -> list[str]:
    """The options that differ. One that there was not yet when `before` was written had `_BEFORE`, or its default."""
    usual = {option: value for option, value in _unsaid().items() if option in now}
    was = _renamed(before)
    if not any(_is(option, _RECORDING) for option in now):
        was = {option: value for option, value in was.items() if not _is(option, _RECORDING)}
    known = usual | {option: value for option, value in was.items() if not _is(option, _FREE)}
    return [option for option in sorted(known.keys() | now.keys()) if known.get(option) != now.get(option)]


def _unsaid() -> Settings:
    """What a run's settings stand for where they do not name an option."""
    return {**settings_of(Config()), **_BEFORE}


def contradiction(what: str, before: Settings, now: Settings) -> str:
    """How settings differ from those of a training that `what` names, in one sentence; empty where they do not."""
    options = differing(before, now)
    if not options:
        return ""
    if options == [_REFERENCES]:
        return f"{what} holds a training on a robot's demonstrations as another version of mjx-hand made them"
    options = [option for option in options if option != _REFERENCES]  # which no command line has
    others = f" and {len(options) - 1} more" if len(options) > 1 else ""
    was = _renamed(before).get(options[0], _unsaid().get(options[0]))
    return f"{what} holds a training with {options[0]}={was}, now {now.get(options[0])}{others}"


def write_settings(config: Config, path: Path) -> None:
    """Write all options as YAML, lists for tuples."""
    options = _nested(_told(config))
    path.write_text(OmegaConf.to_yaml(OmegaConf.create(options)))


def read_settings(path: Path) -> Settings:
    """The options in a file of `write_settings`.

    Raises:
        InputError: it is damaged.
    """
    values = read_yaml(path)
    if not isinstance(values, Mapping) or not {"name", "task", "ppo"} <= set(values):
        raise InputError(f"{path}: not the settings of a training; write it again, or train anew with fresh=true")
    return _renamed(_flat(values))


def with_settings_of(config: Config, run: Settings, given: Collection[str], what: str) -> Config:
    """The configuration with a run's settings for all that the command line does not say.

    Args:
        config: as composed, with defaults for what was not given.
        run: the settings of the run.
        given: the options that the command line gave.
        what: the run, for messages.

    Raises:
        InputError: an option was given that contradicts the run's.
    """
    now = {option: value for option, value in _told(config).items() if option not in _FOUND}
    if "config" in given:
        given = {*given, "name"}
    fixed = {o: v for o, v in now.items() if _is_given(o, given) and not _is(o, (*_FREE, *_FREE_OF_POLICY))}
    if refused := contradiction(what, {o: v for o, v in run.items() if o in fixed}, fixed):
        raise InputError(f"{refused}; leave out that option, or give the folder of another training with out=FOLDER")
    kept = {
        option: value
        for option, value in (_BEFORE | dict(run)).items()
        if option in now and not _is_given(option, given) and (_is(option, _PLACES) or not _is(option, _FREE))
    }
    try:
        return from_dict(Config, _nested(now | kept))
    except InputError:
        raise
    except Exception:  # a file that someone has edited
        raise InputError(f"{what}: holds settings of the wrong types; write them again, or train anew") from None


def _told(config: Config) -> dict[str, Any]:
    options = _flat(json.loads(json.dumps(dataclasses.asdict(config))))
    if config.data.folder:
        options[_CONTENTS] = part_digest(config.data.folder, "train")
    if config.hand != HUMAN:
        options[_REFERENCES] = METHOD
    return options


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in values.items():
        option = f"{prefix}{name}"
        flat |= _flat(value, f"{option}.") if isinstance(value, Mapping) else {option: value}
    return flat


def _nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for option, value in flat.items():
        node = values
        *parts, last = option.split(".")
        for part in parts:
            node = node.setdefault(part, {})
        node[last] = value
    return values


def _renamed(settings: Settings) -> Settings:
    return {RENAMED.get(option, option): value for option, value in settings.items()}


def _relevant(settings: Settings) -> Settings:
    """Without what is said of recordings where the demonstrations are of none."""
    if settings.get("data.grasp") == RECORDED:
        return settings
    return {option: value for option, value in settings.items() if not _is(option, _RECORDING)}


def _is(option: str, names: Collection[str]) -> bool:
    return any(option == name or option.startswith(f"{name}.") for name in names)


def _is_given(option: str, given: Collection[str]) -> bool:
    return _is(option, given) or (option == "seed" and "seeds" in given)
