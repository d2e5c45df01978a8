"""What stands in a command's folder: all of it to compare, and what of it tells that the command is at work."""

import hashlib
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path

_LOGS = "tensorboard"  # every start adds a file there
_OF_THE_MOMENT = (".retarget-ledger.jsonl", "config.yaml", "lock")  # times of change, the folder's name, a process
_TIMES = ("notes.npy", "digest.npy")  # of a state: the seconds that it took, and a digest of these too


def below(folder: Path) -> Iterator[Path]:
    """All files and folders, hidden ones too, but for logs."""
    for at, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if name != _LOGS]
        yield from (Path(at) / name for name in [*folders, *files])


def contents(folder: Path) -> dict[str, str]:
    """The name of each, and a digest of what it holds without what tells the time."""
    return {str(path.relative_to(folder)): _digest(path) for path in below(folder)}


def signs(folder: Path) -> set[tuple[str, int]]:
    """Folders and files that have their names, and when these were written."""
    found = set()
    for path in below(folder):
        try:
            if path.is_dir():
                found.add((str(path), 0))
            elif not path.name.startswith(".") and path.name not in _OF_THE_MOMENT:
                found.add((str(path), path.stat().st_mtime_ns))
        except FileNotFoundError:  # it has just got another name
            pass
    return found


def _digest(path: Path) -> str:
    found = hashlib.sha256()
    if path.suffix == ".npz":
        with zipfile.ZipFile(path) as archive:
            for name in sorted(set(archive.namelist()) - set(_TIMES)):
                found.update(name.encode() + archive.read(name))
    elif path.name == "curve.csv":  # its second column is seconds
        rows = [line.split(",") for line in path.read_text().splitlines()]
        found.update(repr([row[:1] + row[2:] for row in rows]).encode())
    elif path.name not in _OF_THE_MOMENT and path.is_file():
        found.update(path.read_bytes())
    return found.hexdigest()
