"""What a few command-line overrides stand for, before Hydra composes them."""

from collections.abc import Sequence

from envs.demonstrations.set_settings import GIVEN
from mjx_hand.errors import InputError
from train.settings.device import with_device

_FOLDER = "data.folder"


def completed(overrides: Sequence[str]) -> list[str]:
    """The overrides, flags of Hydra's among them, with a device and with the experiment that `data.folder` stands for.

    Raises:
        InputError: as `with_device` and `with_folder`.
    """
    return with_device(with_folder(overrides))


def with_folder(overrides: Sequence[str]) -> list[str]:
    """The overrides, with `config=given` before `data.folder=PATH`.

    Raises:
        InputError: beside the folder, an experiment or an option of `data`, which is for sets that are made.
    """
    options = [(o.lstrip("+~").partition("=")[0], o) for o in overrides if not o.startswith("-")]
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
