"""Checkpoints: network parameters as named arrays in one `.npz`, without pickle, and what it takes to use them."""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from mjx_hand.errors import InputError, reason_of
from mjx_hand.files.checked_arrays import numbers, text
from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.files.npz_reader import Arrays

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
        settings: of the training, those that it cannot do without (`train.settings.saved.policy_settings`); empty for
            policies of before they were kept.
    """

    policy: Mapping[str, Any]
    value: Mapping[str, Any]
    steps: int
    success: float
    experiment: str
    observation_size: int
    settings: Mapping[str, Any] = dataclasses.field(default_factory=dict)


def save_checkpoint(checkpoint: Checkpoint, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/policy/1); the file appears whole or not at all."""
    save_arrays(path, SCHEMA, _arrays(checkpoint))


def _arrays(checkpoint: Checkpoint) -> dict[str, Any]:
    arrays: dict[str, Any] = {
        "steps": checkpoint.steps,
        "success": checkpoint.success,
        "experiment": checkpoint.experiment,
        "observation_size": checkpoint.observation_size,
        "settings": json.dumps(dict(checkpoint.settings), sort_keys=True),
    }
    for part in ("policy", "value"):
        arrays |= {f"{part}/{name}": leaf for name, leaf in _flat(getattr(checkpoint, part))}
    return arrays


def is_saved(checkpoint: Checkpoint, path: str | Path) -> bool:
    """Whether a file holds this very checkpoint, whole."""
    try:
        arrays = dict(load_arrays(path, SCHEMA))
    except InputError:
        return False
    wanted = {name: np.asarray(value) for name, value in _arrays(checkpoint).items()}
    same = (a.dtype == b.dtype and a.tobytes() == b.tobytes() for a, b in ((arrays[n], wanted[n]) for n in wanted))
    return arrays.keys() == wanted.keys() and all(same)


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
    for name in arrays:
        part, *rest = name.split("/")
        if part in trees and rest:
            leaf = np.asarray(arrays[name])
            if leaf.dtype.kind != "f":
                raise InputError(f"{path}: {name} holds {leaf.dtype}, expected numbers; train it again")
            node: Any = trees[part]
            for key in rest[:-1]:
                node = node.setdefault(key, {})
                if not isinstance(node, dict):
                    raise InputError(f"{path}: {name} is below another parameter; train it again")
            if rest[-1] in node:
                raise InputError(f"{path}: {name} holds other parameters; train it again")
            node[rest[-1]] = jnp.asarray(leaf)
    known = numbers(path, arrays, {"steps": (), "success": (), "observation_size": ()}, finite=False)
    if not np.isfinite([float(known[name]) for name in ("steps", "observation_size")]).all():
        raise InputError(f"{path}: steps or observation_size is no number; train it again")
    return Checkpoint(
        policy=trees["policy"],
        value=trees["value"],
        steps=int(known["steps"]),
        success=float(known["success"]),
        experiment=text(path, arrays, "experiment"),
        observation_size=int(known["observation_size"]),
        settings=_settings(path, arrays) if "settings" in arrays else {},
    )


def _settings(path: str | Path, arrays: Arrays) -> Mapping[str, Any]:
    try:
        settings = json.loads(text(path, arrays, "settings"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: its settings cannot be read ({reason_of(error)}); train it again") from None
    if not isinstance(settings, dict):
        raise InputError(f"{path}: its settings are a {type(settings).__name__}; train it again")
    return settings


def _flat(tree: Mapping[str, Any], prefix: str = "") -> list[tuple[str, np.ndarray]]:
    out = []
    for key, value in tree.items():
        if "/" in key:
            raise ValueError(f"parameter name {key!r} holds a slash, which checkpoints use as separator")
        out += _flat(value, f"{prefix}{key}/") if isinstance(value, Mapping) else [(prefix + key, np.asarray(value))]
    return out
