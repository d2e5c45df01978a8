"""Checkpoints: network parameters as named arrays in one `.npz`, without pickle, and what it takes to use them."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import load_arrays, save_arrays

SCHEMA = "mjx-hand/policy/1"


@dataclasses.dataclass(frozen=True)
class Checkpoint:
    """A policy and where it comes from.

    Attributes:
        policy, value: nested dictionaries of arrays, as Flax has them.
        steps: control steps of training behind it.
        success: share of training demonstrations it tracks from frame 0, or NaN where not evaluated.
        experiment: name of the configuration.
        observation_size: length of the observations it reads.
    """

    policy: Mapping[str, Any]
    value: Mapping[str, Any]
    steps: int
    success: float
    experiment: str
    observation_size: int


def save_checkpoint(checkpoint: Checkpoint, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/policy/1); the file appears whole or not at all."""
    arrays: dict[str, Any] = {
        "steps": checkpoint.steps,
        "success": checkpoint.success,
        "experiment": checkpoint.experiment,
        "observation_size": checkpoint.observation_size,
    }
    for part in ("policy", "value"):
        arrays |= {f"{part}/{name}": leaf for name, leaf in _flat(getattr(checkpoint, part))}
    save_arrays(path, SCHEMA, arrays)


def load_checkpoint(path: str | Path) -> Checkpoint:
    """Read what `save_checkpoint` wrote.

    Raises:
        InputError: no such file, or not a checkpoint of this version.
    """
    if not Path(path).is_file():
        raise InputError(
            f"{path}: no such checkpoint; train one first: python -m train.ppo, or name it: checkpoint=FILE"
        )
    arrays = load_arrays(path, SCHEMA)
    trees: dict[str, dict[str, Any]] = {"policy": {}, "value": {}}
    for name, leaf in arrays.items():
        part, *rest = name.split("/")
        if part in trees and rest:
            node = trees[part]
            for key in rest[:-1]:
                node = node.setdefault(key, {})
            node[rest[-1]] = jnp.asarray(leaf)
    try:
        return Checkpoint(
            policy=trees["policy"],
            value=trees["value"],
            steps=int(arrays["steps"]),
            success=float(arrays["success"]),
            experiment=str(arrays["experiment"]),
            observation_size=int(arrays["observation_size"]),
        )
    except KeyError as error:
        raise InputError(f"{path}: a checkpoint without {error.args[0]!r}; train it again") from None


def _flat(tree: Mapping[str, Any], prefix: str = "") -> list[tuple[str, np.ndarray]]:
    out = []
    for key, value in tree.items():
        if "/" in key:
            raise ValueError(f"parameter name {key!r} holds a slash, which checkpoints use as separator")
        out += _flat(value, f"{prefix}{key}/") if isinstance(value, Mapping) else [(prefix + key, np.asarray(value))]
    return out
