"""A process that reads mutants, with 4 GiB of memory more than it starts with, and says of each what came of it.

    python -m tests.fuzz.worker FOLDER

Each line of its input is a number of a mutant; each line of its output what came of it, as JSON. What would run code,
start a process, open a socket or write outside of the folder is a fault even where an `InputError` follows.
"""

import contextlib
import io
import json
import os
import resource
import shutil
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.errors import InputError
from tests.fuzz.mutants import mutant
from tests.fuzz.readers import READERS
from tests.fuzz.valid_files import Valid, write_valid

MEMORY = 4 * 2**30  # bytes
_LONGEST = 1000  # letters of a message
_MUCH = 2**20  # KiB: what a load may take at most
_FORBIDDEN = ("os.system", "os.exec", "os.posix_spawn", "os.spawn", "subprocess.Popen", "socket.connect", "pty.spawn")


class _Watch:
    """What an audit hook saw since it was asked last."""

    def __init__(self, folder: Path):
        self.folder, self.seen = str(folder), ""
        sys.addaudithook(self._event)

    def _event(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event in _FORBIDDEN:
            self.seen = f"{event} {arguments!r}"[:200]
        elif event == "open" and isinstance(arguments[0], str | bytes | os.PathLike):
            path, flags = os.fsdecode(arguments[0]), arguments[2]
            writes = isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
            if writes and not path.startswith((self.folder, os.devnull)):
                self.seen = f"writes {path}"[:200]

    def taken(self) -> str:
        seen, self.seen = self.seen, ""
        return seen


def make(valid: list[Valid], number: int, folder: Path) -> tuple[Valid, str, Path]:
    """The mutant of that number: what it is one of, the reader whose turn it is, and what to open."""
    rng = np.random.default_rng(number)
    case = valid[number % len(valid)]
    opened = _copy(case, folder)
    path = folder / case.changed
    path.write_bytes(mutant(rng, case.changed, path.read_bytes()))
    return case, case.readers[number // len(valid) % len(case.readers)], opened


def _copy(case: Valid, folder: Path) -> Path:
    """What to open of a copy: some readers write what they have read anew."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(case.root, folder)
    return folder / case.opened


def read(case: Valid, reader: str, path: Path) -> tuple[str, str]:
    """What came of it ("read", "refused", "exception", "message") and what was said."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            READERS[reader](path, dict(case.choice))
        except InputError as error:
            text = str(error)
            return ("refused" if "\n" not in text and len(text) <= _LONGEST else "message"), text[:300]
        except Exception as error:
            place = traceback.extract_tb(error.__traceback__)[-1]
            return "exception", f"{type(error).__name__}: {str(error)[:200]} ({place.filename}:{place.lineno})"
    return "read", ""


def main(folder: Path) -> None:
    """Serve the numbers of standard input."""
    sys.set_int_max_str_digits(4300)  # as every Python starts
    valid = write_valid(folder / "valid")
    as_they_are = [
        (case, reader, *read(case, reader, _copy(case, folder / "mutant"))) for case in valid for reader in case.readers
    ]
    wrong = [
        f"{case.format} {reader}: {outcome} {text}" for case, reader, outcome, text in as_they_are if outcome != "read"
    ]
    assert not wrong, "\n".join(wrong)  # and what is compiled or imported late is there from now on
    watch = _Watch(folder)
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, size + MEMORY))
    print(json.dumps([[case.format, case.changed] for case in valid]), flush=True)
    for line in sys.stdin:
        number = int(line)
        case, reader, path = make(valid, number, folder / "mutant")
        watch.taken()
        before, began = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.monotonic()
        outcome, text = read(case, reader, path)
        seconds = time.monotonic() - began
        if seen := watch.taken():
            outcome, text = "escaped", seen
        elif resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before > _MUCH:
            outcome, text = "memory", text
        told = {"number": number, "reader": reader, "outcome": outcome, "text": text, "seconds": round(seconds, 3)}
        print(json.dumps(told), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
