"""Calibration files beside a recording: YAML or JSON with shape coefficients and camera transforms."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.safe_yaml import read_yaml, shown

FARTHEST = 1e4  # m; no camera is there


def read_settings(path: Path, needed: Mapping[str, type]) -> dict[str, Any]:
    """The dictionary in a YAML (or JSON) file beside a recording.

    Args:
        path: of the file.
        needed: the names that it must have, and of what type; a list must have entries.

    Raises:
        InputError: it is missing, is not one, or lacks what is needed.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; keep the dataset's folders as they were published")
    found = read_yaml(path)
    missing = [name for name in needed if not isinstance(found, dict) or name not in found]
    if missing:
        raise InputError(f"{path}: has no {missing[0]!r}; it needs {', '.join(needed)}")
    for name, kind in needed.items():
        if not isinstance(found[name], kind) or (kind is list and not found[name]):
            raise InputError(f"{path}: {name} is {shown(found[name])}, expected a {kind.__name__}")
    return found


def betas(path: Path) -> Float[np.ndarray, "10"]:
    """The subject's shape coefficients in a calibration file.

    Raises:
        InputError: the file is missing or has no ten numbers.
    """
    return numbers(path, {"betas": _listed(read_settings(path, {"betas": list})["betas"])}, {"betas": (10,)})["betas"]


def transform(path: Path, name: str) -> Float[np.ndarray, "3 4"]:
    """The rigid transform of that name in a file of camera extrinsics (12 numbers, row by row).

    Raises:
        InputError: it is missing, or not such a transform.
    """
    found = read_settings(path, {"extrinsics": dict})["extrinsics"]
    given = {name: _listed(found[name]).reshape(-1)} if name in found else {}
    matrix = numbers(path, given, {name: (12,)})[name].reshape(3, 4).astype(float)
    if np.abs(matrix).max() > FARTHEST or np.abs(matrix[:, :3] @ matrix[:, :3].T - np.eye(3)).max() > 1e-3:
        raise InputError(f"{path}: {name} is not a rigid transform; get the calibration again")
    return matrix


def _listed(values: Any) -> np.ndarray:
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError):
        return np.asarray(values, object)
