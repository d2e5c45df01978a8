"""The whole state of a training on disk, so that it goes on as if it had never been stopped.

`out/state/STEPS.npz` (schema mjx-hand/run/2) holds every array of the learner and the evaluations so far. The last few
are kept, each with a digest of its contents: a damaged one is named and the one before it used.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np

from mjx_hand.errors import InputError, reason_of
from mjx_hand.files.checked_arrays import text
from mjx_hand.files.digests import digest
from mjx_hand.files.npz_archive import load_arrays, save_arrays

SCHEMA = "mjx-hand/run/2"
KEPT = 3


def save_run(folder: Path, steps: int, state: Any, notes: Mapping[str, Any]) -> Path:
    """Write the state after so many steps, and delete all but the last few.

    Args:
        folder: of the states; made if absent.
        steps: names the file.
        state: a pytree of arrays that this process can read.
        notes: anything else, as JSON has it.

    Raises:
        InputError: it cannot be written; the states before it stay.
    """
    arrays = {f"state{name}": leaf for name, leaf in _named(state)} | {"notes": np.array(json.dumps(notes))}
    path = folder / f"{steps:012d}.npz"
    save_arrays(path, SCHEMA, arrays | {"digest": _digest(arrays)})
    for old in _files(folder)[KEPT:]:
        old.unlink(missing_ok=True)
    return path


def load_run(
    folder: Path, template: Any, check: Callable[[Mapping[str, Any]], None] = lambda notes: None
) -> tuple[Any, dict[str, Any]] | None:
    """State and notes of the newest sound file, or None where there is none yet.

    Args:
        folder: of the states.
        template: a pytree of the same structure, with shapes and types.
        check: raises InputError for notes that are of another training.

    Raises:
        InputError: files are there and none is sound, of this structure, and of this training.
    """
    faults = []
    for path in _files(folder):
        try:
            return _read(path, template, check)
        except InputError as error:
            faults.append(str(error))
            print(f"damaged, so the state before it is used: {error}", flush=True)
    if faults:
        raise InputError(
            f"no sound state in {folder} ({faults[0]}); train anew with fresh=true, or choose another folder with "
            "out=FOLDER"
        )
    return None


def _read(path: Path, template: Any, check: Callable[[Mapping[str, Any]], None]) -> tuple[Any, dict[str, Any]]:
    arrays = dict(load_arrays(path, SCHEMA))
    digest = text(path, arrays, "digest")
    del arrays["digest"]
    if digest != _digest(arrays):
        raise InputError(f"{path}: its contents do not match its digest")
    try:
        notes = json.loads(text(path, arrays, "notes"))
        check(notes)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except Exception as error:  # someone else's notes may be anything
        raise InputError(f"{path}: its notes are not those of a training ({reason_of(error)})") from None
    return _filled(path, template, arrays), notes


def _files(folder: Path) -> list[Path]:
    """Newest first; files that are still being written begin with a dot."""
    return sorted((path for path in folder.glob("[0-9]*.npz")), reverse=True)


def _named(tree: Any) -> list[tuple[str, np.ndarray]]:
    leaves, _ = jax.tree_util.tree_flatten_with_path(tree)
    return [(jax.tree_util.keystr(path), np.asarray(leaf)) for path, leaf in leaves]


def _filled(path: Path, template: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    leaves, structure = jax.tree_util.tree_flatten_with_path(template)
    found = []
    for place, wanted in leaves:
        name = f"state{jax.tree_util.keystr(place)}"
        value = arrays.get(name)
        if value is None or value.shape != wanted.shape or value.dtype != wanted.dtype:
            has = "nothing" if value is None else f"{value.dtype}{list(value.shape)}"
            raise InputError(
                f"{path}: holds {has} for {name}, expected {wanted.dtype}{list(wanted.shape)}: it is of another "
                "version or task"
            )
        found.append(value)
    return jax.tree_util.tree_unflatten(structure, found)


def _digest(arrays: Mapping[str, np.ndarray]) -> str:
    # Types by their names, where exported policies have NumPy's codes: both stand in files of users.
    values = [(name, np.asarray(arrays[name])) for name in sorted(arrays)]
    return digest(piece for name, v in values for piece in (f"{name} {v.dtype} {v.shape}".encode(), v.tobytes()))
