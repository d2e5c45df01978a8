"""What is in a file of unknown form, in a few words: the names, shapes and columns that whoever made it will know."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.files.contents import WHOLE, plain
from mjx_hand.files.delimited import Table
from mjx_hand.files.parquet_table import columns, count_rows, has_pyarrow, is_parquet
from mjx_hand.files.safe_pickle import Record
from mjx_hand.files.safe_tensor import is_tensor

LONGEST = 250  # characters of a description
SHOWN = 6  # names that are listed
_LONGEST = 60  # characters of a name
_DEEPEST = 2  # objects within objects whose names are told
_START = 4096  # bytes that tell text from anything else


def described(path: Path, contents: Any = None) -> str:
    """What a file or folder holds.

    Args:
        path: of the file or folder.
        contents: what a reader found in it: named values, a JSON value, a table, or nothing.
    """
    text = _described(path, contents)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"


def _described(path: Path, contents: Any) -> str:
    if path.is_dir():
        names = sorted(each.name for each in path.iterdir())
        return f"a folder of {_listed(names)}" if names else "an empty folder"
    if isinstance(contents, Table):
        return f"a table of {len(contents.lines)} rows and the columns {_listed(contents.columns)}"
    if is_parquet(path) and has_pyarrow():
        return f"a table of {count_rows(path)} rows and the columns {_listed(columns(path))}"
    if isinstance(contents, Mapping) and list(contents) == [WHOLE]:
        return f"{_value(contents[WHOLE])} without names"
    if isinstance(contents, Mapping) and contents:
        return f"an {path.suffix} of {_named(contents, 0)}"
    return _value(contents) if isinstance(contents, list) and contents else _bytes(path)


def _value(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array {value.shape} of {value.dtype}"
    if isinstance(value, Record):
        return _record(value)
    if isinstance(value, list | tuple):
        first = next((each for each in value if isinstance(each, Mapping)), None)
        return f"a list {_shape(value)}" if first is None else f"a list of {len(value)} objects with {_named(first, 1)}"
    return f"a lone {type(value).__name__}"


def _named(value: Mapping[Any, Any], depth: int) -> str:
    """Names, and where they stand for arrays or further names, which."""
    parts = []
    for name, each in list(value.items())[:SHOWN]:
        if isinstance(each, Mapping) and depth < _DEEPEST:
            inner = f" ({_named(each, depth + 1)})" if each else ""
        elif isinstance(each, list) and each and each[0] and isinstance(each[0], Mapping) and depth < _DEEPEST:
            inner = f" ({len(each)} objects with {_named(each[0], depth + 1)})"
        elif isinstance(each, np.ndarray | Record | list | tuple):
            inner = f" {_short(each)}"
        else:
            inner = ""
        parts.append(f"{_cut(name)}{inner}")
    return ", ".join(parts) + (" and more" if len(value) > SHOWN else "")


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return str(value.shape)
    return _record(value) if isinstance(value, Record) else _shape(value)


def _record(value: Record) -> str:
    try:
        return f"{plain('', '', value).shape}"
    except InputError:
        return f"({'a tensor' if is_tensor(value) else _cut(value.name)})"


def _shape(value: Any) -> str:
    """The lengths of lists within lists, as an array's shape."""
    lengths = []
    while isinstance(value, list | tuple) and len(lengths) < 5:
        lengths.append(len(value))
        value = value[0] if value else None
    return f"({', '.join(map(str, lengths))}{',' if len(lengths) == 1 else ''})"


def _bytes(path: Path) -> str:
    try:
        with path.open("rb") as opened:
            start = opened.read(_START)
    except OSError as error:
        return f"a file that cannot be read ({error.strerror})"
    kind = f"{path.suffix} file" if path.suffix else "file without a suffix"
    size = f"{path.stat().st_size} bytes"
    if b"\0" in start:
        return f"a binary {kind} of {size}"
    line = next((each.strip() for each in start.decode("utf-8", "replace").splitlines() if each.strip()), "")
    return f"a {kind} of {size} that begins {_cut(line)!r}"


def _listed(names: Iterable[Any]) -> str:
    listed = [_cut(name) for name in names]
    return ", ".join(listed[:SHOWN]) + (" and more" if len(listed) > SHOWN else "")


def _cut(name: Any) -> str:
    text = " ".join(str(name).split())
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
