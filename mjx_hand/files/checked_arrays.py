"""Checks of a file's arrays before anything is made of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.files.npz_reader import Arrays

Dimension = int | str
# Lines of text. Not tuple[str, ...]: type checkers at run time look at an item of it that they draw by chance, which
# whoever builds random data from a seed (Hypothesis) must not have.
Lines = tuple[Any, ...]


def numbers(
    path: str | Path,
    arrays: Arrays,
    layout: Mapping[str, tuple[Dimension, ...]],
    *,
    finite: bool = True,
) -> dict[str, np.ndarray]:
    """The arrays that `layout` names, if each is there, numeric and of its shape.

    Args:
        path: for the messages.
        arrays: what the file holds.
        layout: each array's shape; a letter stands for one length, the same wherever it occurs. "t" counts frames, of
            which there must be one.
        finite: refuse NaN and infinity too.

    Raises:
        InputError: an array is missing, is not numeric, or has another shape, no frames or, if asked for, NaN.
    """
    sizes: dict[str, int] = {}
    found = {}
    for name, wanted in layout.items():
        if name not in arrays:
            raise InputError(f"{path}: has no {name!r}; it needs {', '.join(layout)}")
        value = np.asarray(arrays[name])
        if value.dtype.kind not in "fiub":
            raise InputError(f"{path}: {name} holds {value.dtype}, expected numbers")
        known = [sizes.get(d, d) if isinstance(d, str) else d for d in wanted]
        fits = value.ndim == len(known) and all(
            isinstance(k, str) or k == n for k, n in zip(known, value.shape, strict=True)
        )
        if not fits:
            expected = ", ".join(map(str, known))
            raise InputError(f"{path}: {name} has shape {value.shape}, expected ({expected})")
        sizes |= {d: n for d, n in zip(wanted, value.shape, strict=True) if isinstance(d, str)}
        if sizes.get("t") == 0:
            raise InputError(f"{path}: the recording has no frames ({name} has shape {value.shape}); save at least one")
        if value.dtype.kind == "f" and value.dtype.itemsize > 8:
            value = value.astype(float)  # long doubles, which nothing here computes with
        if finite and not np.isfinite(value).all():
            where = tuple(int(i) for i in np.argwhere(~np.isfinite(value))[0])
            raise InputError(f"{path}: {name} has NaN or infinity, first at {where}; repair or leave out those frames")
        found[name] = value
    return found


def text(path: str | Path, arrays: Arrays, name: str) -> str:
    """The string of that name.

    Raises:
        InputError: it is missing, or is not one string.
    """
    return _strings(path, arrays, name, 0).item()


def texts(path: str | Path, arrays: Arrays, name: str, *, needed: bool = True) -> Lines:
    """The list of strings of that name; none where it is missing and not `needed`.

    Raises:
        InputError: it is missing, or is not a list of strings.
    """
    if not needed and name not in arrays:
        return ()
    return tuple(_strings(path, arrays, name, 1).tolist())


def _strings(path: str | Path, arrays: Arrays, name: str, ndim: int) -> np.ndarray:
    if name not in arrays:
        raise InputError(f"{path}: has no {name!r}")
    value = np.asarray(arrays[name])
    empty = value.shape == (0,)  # which NumPy takes for numbers
    if not (value.dtype.kind == "U" or empty) or value.ndim != ndim:
        raise InputError(
            f"{path}: {name} holds {value.dtype} of shape {value.shape}, expected "
            f"{'one text' if ndim == 0 else 'a list of texts'}"
        )
    return value
