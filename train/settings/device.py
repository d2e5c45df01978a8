"""Which device JAX computes on, and the preset that goes with it: `device=auto|cpu|gpu`.

The presets are `configs/device/NAME.yaml`, which experiments and the command line change. `auto`, which is also what no
word stands for, becomes `gpu` where JAX computes on an accelerator.
"""

import importlib.util
from collections.abc import Sequence

import jax

from mjx_hand.errors import InputError
from train.settings.options import Distributed
from train.settings.processes import join

DEVICES = ("cpu", "gpu")
AUTO = "auto"
_PLUGINS = ("jax_cuda12_plugin", "jax_cuda13_plugin", "jax_rocm7_plugin")


def with_device(overrides: Sequence[str]) -> list[str]:
    """The overrides, flags of Hydra's among them, with one of `DEVICES` in place of `device=auto` or of none.

    Raises:
        InputError: a device that is not known.
    """
    key = "device="
    given = [override.removeprefix(key) for override in overrides if override.startswith(key)]
    if given and given[-1] not in (AUTO, *DEVICES):
        raise InputError(f"device is {given[-1]!r}; valid: {AUTO}, {', '.join(DEVICES)}")
    if given and given[-1] != AUTO:
        return list(overrides)
    several = any(o.startswith("distributed.processes=") and not o.endswith("=1") for o in overrides)
    others = [override for override in overrides if not override.startswith(key)]
    # Among the other overrides: Hydra's parser of arguments takes them in one piece.
    place = next((k for k, o in enumerate(others) if "=" in o and not o.startswith("-")), 0)
    return [*others[:place], f"{key}{_detected(several)}", *others[place:]]


def _detected(several: bool) -> str:
    """What JAX computes on here. Before several processes have joined it cannot be asked, so its plug-ins tell."""
    if several:
        return "gpu" if any(importlib.util.find_spec(name) for name in _PLUGINS) else "cpu"
    return "cpu" if jax.default_backend() == "cpu" else "gpu"


def use_device(device: str, distributed: Distributed) -> None:
    """Compute on one of `DEVICES`; called before anything is computed. Joins the other processes, if there are any.

    Raises:
        InputError: JAX has no such device here, or as `train.settings.processes.join`.
    """
    if device == "cpu":
        jax.config.update("jax_platforms", "cpu")
    join(distributed)
    if (jax.default_backend() == "cpu") != (device == "cpu"):
        raise InputError(
            "device=gpu, but JAX finds no GPU here; on Linux with an NVIDIA driver install what it needs: "
            "pip install 'mjx-hand[cuda]', or leave the choice to device=auto"
        )


def described() -> str:
    """What JAX computes on, for people."""
    devices = jax.devices()
    if jax.default_backend() == "cpu":
        return "the CPU"
    return f"{len(devices)} x {devices[0].device_kind}" if len(devices) > 1 else devices[0].device_kind
