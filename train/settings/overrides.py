"""What a few command-line overrides stand for, before Hydra composes them."""

from collections.abc import Mapping, Sequence

from envs.demonstrations.set_settings import GIVEN
from mjx_hand.errors import InputError
from train.settings.device import with_device

_FOLDER = "data.folder"
# What options were called once, on the command line and in folders of older trainings.
RENAMED = {
    "task.wrist_move": "task.residual_scale_wrist_position",
    "task.wrist_turn": "task.residual_scale_wrist_rotation",
    "task.finger": "task.residual_scale_fingers",
    "task.position_sharpness": "task.reward_position_alpha",
    "task.rotation_sharpness": "task.reward_rotation_alpha",
    "task.lost_at": "task.termination_distance",
    "task.lost_at_last": "task.termination_distance_last",
    "task.mid_start": "task.random_start_prob",
    "task.ahead": "task.lookahead",
    "task.action_cost": "task.rewards.action",
}


def completed(overrides: Sequence[str]) -> list[str]:
    """The overrides, flags of Hydra's among them, with a device and with the experiment that `data.folder` stands for.

    Options by the names that they had once have their present ones.

    Raises:
        InputError: as `with_device` and `with_folder`.
    """
    return with_device(with_folder([_with_new_name(override) for override in overrides]))


def options_given(overrides: Sequence[str]) -> list[str]:
    """The options that overrides name, flags left out."""
    return [_option(_with_new_name(override)) for override in overrides if not override.startswith("-")]


def old_names(overrides: Sequence[str]) -> dict[str, str]:
    """The options among overrides that have another name now, and that name."""
    return {option: RENAMED[option] for option in map(_option, overrides) if option in RENAMED}


def listed(own: Mapping[str, str], key: str, otherwise: Sequence[str]) -> list[str]:
    """The names of an argument such as names=[power,pinch], each once; `otherwise` where it is not given.

    Raises:
        InputError: it names nothing.
    """
    names = [name.strip(" '\"") for name in own[key].strip("[]").split(",")] if key in own else list(otherwise)
    if not all(names):
        raise InputError(f"{key}={own[key]} names nothing; give for example {key}=[{','.join(otherwise)}]")
    return list(dict.fromkeys(names))


def _option(override: str) -> str:
    return override.lstrip("+~").partition("=")[0]


def _with_new_name(override: str) -> str:
    option = _option(override)
    return override.replace(option, RENAMED[option], 1) if option in RENAMED else override


def with_folder(overrides: Sequence[str]) -> list[str]:
    """The overrides, with `config=given` before `data.folder=PATH`.

    Raises:
        InputError: beside the folder, an experiment or an option of `data`, which is for sets that are made.
    """
    options = [(_option(o), o) for o in overrides if not o.startswith("-")]
    if _FOLDER not in dict(options):
        return list(overrides)
    chosen = f"config={GIVEN}"
    for key, override in options:
        if (key == "config" or key.startswith("data.")) and key != _FOLDER and override != chosen:
            raise InputError(
                f"{override} beside {_FOLDER}: finished demonstrations are taken as they are, and their experiment is "
                f"{chosen!r}; leave out one of the two (other options, such as ppo.num_updates, may be given)"
            )
    others = [override for override in overrides if override != chosen]
    place = next(k for k, o in enumerate(others) if o.lstrip("+~").startswith(f"{_FOLDER}="))
    return [*others[:place], chosen, *others[place:]]
