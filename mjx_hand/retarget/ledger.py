"""What of a data set is done: one line a finished file, kept beside the outputs so that a killed run can go on.

A file counts as done if its line carries the same key (input, options) as now and the output is the very file that the
line was written for. Lines are appended after the output has its name; one that a kill has torn is not understood, and
its file is done again.
"""

import dataclasses
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mjx_hand.errors import InputError
from mjx_hand.files.digests import json_digest
from mjx_hand.files.npz_archive import replacing
from mjx_hand.retarget.summary import Outcome

NAME = ".retarget-ledger.jsonl"


def key_of(source: Path, settings: Mapping[str, Any]) -> str:
    """A digest of the settings and of the input's size and time of change (of all its files, if it is a folder)."""
    files = sorted(p for p in source.rglob("*") if p.is_file()) if source.is_dir() else [source]
    stamps = [(str(p.relative_to(source)), p.stat().st_size, p.stat().st_mtime_ns) for p in files]
    return json_digest({"settings": dict(settings), "input": stamps}, default=str)


class Ledger:
    """The finished files of one output folder.

    Raises:
        InputError: the folder cannot be written.
    """

    def __init__(self, folder: Path):
        self._path = folder / NAME
        self._lines: dict[str, dict[str, Any]] = {}
        if self._path.is_file():
            for line in self._path.read_text(errors="replace").splitlines():
                entry = _understood(line)
                if entry is not None:
                    self._lines[entry["row"]["file"]] = entry
        # Written anew, so that what is appended does not continue a torn line.
        with replacing(self._path) as temporary:
            temporary.write_text("".join(json.dumps(entry) + "\n" for entry in self._lines.values()))

    def done(self, file: str, key: str, output: Path) -> Outcome | None:
        """The row of a file that is done, None of one that is not."""
        entry = self._lines.get(file)
        if entry is None or entry.get("key") != key or entry.get("output") != _stamp(output):
            return None
        return Outcome(**entry["row"])

    def knows(self, file: str) -> bool:
        """Whether an earlier run has made this file's output."""
        return file in self._lines

    def add(self, outcome: Outcome, key: str, output: Path) -> None:
        """Note that a file is done; `output` has its name already.

        Raises:
            InputError: the ledger cannot be written.
        """
        entry = {"row": dataclasses.asdict(outcome), "key": key, "output": _stamp(output)}
        self._lines[outcome.file] = entry
        try:
            with self._path.open("a") as file:
                file.write(json.dumps(entry) + "\n")
        except OSError as error:
            raise InputError(f"cannot write {self._path}: {os.strerror(error.errno or 0)}; make room there") from None


def _understood(line: str) -> dict[str, Any] | None:
    """The entry in a line; None where a kill has torn it, or someone else has written it."""
    try:
        entry = json.loads(line)
        row, key, output = vars(Outcome(**entry["row"])), entry["key"], entry["output"]
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    # Nothing but what `add` writes, so that no depth of lists comes out that could not be written again.
    kinds = {name: type(value) for name, value in vars(Outcome("", "")).items()}
    sound = all(isinstance(value, int | float if kinds[name] is float else kinds[name]) for name, value in row.items())
    stamped = isinstance(output, list) and all(isinstance(number, int) for number in output)
    return {"row": row, "key": key, "output": output} if sound and stamped and isinstance(key, str) else None


def _stamp(path: Path) -> list[int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return [status.st_size, status.st_mtime_ns]
