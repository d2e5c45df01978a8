"""Many mutants of every format through `worker`, each within 20 seconds, and the table of what came of them.

    python -m tests.fuzz.campaign COUNT [FIRST]

prints it, and every fault with its number, from which `worker.make` makes the file again.
"""

import collections
import dataclasses
import json
import select
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

SECONDS = 20.0  # for one file
_START = 300.0  # s for the first, with all that is imported and compiled
FAULTS = ("exception", "message", "escaped", "memory", "time", "death")
_ROOT = Path(__file__).parents[2]


@dataclasses.dataclass
class Row:
    """What came of the mutants of one format."""

    files: int = 0
    outcomes: collections.Counter[str] = dataclasses.field(default_factory=collections.Counter)
    slowest: float = 0.0


class _Worker:
    """A worker process; a new one where it has died or hangs."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.process: subprocess.Popen[str] | None = None
        self.cases: list[list[str]] = []

    def start(self) -> subprocess.Popen[str]:
        if self.process is None:
            folder = tempfile.mkdtemp(dir=self.folder)
            command = [sys.executable, "-m", "tests.fuzz.worker", folder]
            pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
            self.process = subprocess.Popen(command, cwd=_ROOT, **pipes)
            self.cases = json.loads(self._line(_START) or "[]")
            assert self.cases, "the worker does not start"
        return self.process

    def ask(self, number: int) -> dict[str, Any]:
        process = self.start()
        assert process.stdin is not None
        print(number, file=process.stdin, flush=True)
        line = self._line(SECONDS)
        if line:
            return json.loads(line)
        outcome = "time" if process.poll() is None else "death"
        self.stop()
        return {"number": number, "reader": "", "outcome": outcome, "text": "", "seconds": SECONDS}

    def stop(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process = None

    def _line(self, seconds: float) -> str:
        assert self.process is not None
        assert self.process.stdout is not None
        return self.process.stdout.readline() if select.select([self.process.stdout], [], [], seconds)[0] else ""


def outcomes(numbers: Sequence[int], folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """The format of each mutant, and what came of it."""
    worker = _Worker(folder)
    try:
        worker.start()
        for number in numbers:
            found = worker.ask(number)
            yield worker.cases[number % len(worker.cases)][0], found
    finally:
        worker.stop()


def tabulate(results: Sequence[tuple[str, dict[str, Any]]]) -> str:
    """A Markdown table, a row a format and one for all."""
    rows: dict[str, Row] = collections.defaultdict(Row)
    for format, found in results:
        for name in (format, "all"):
            row = rows[name]
            row.files += 1
            row.outcomes[found["outcome"]] += 1
            row.slowest = max(row.slowest, found["seconds"])
    names = [*sorted(name for name in rows if name != "all"), "all"]
    kinds = ("read", "refused", "exception", "death", "message", "escaped", "memory", "time")
    lines = [f"| format | files | {' | '.join(kinds)} | slowest (s) |", "|---" * (len(kinds) + 3) + "|"]
    for name in names:
        o = rows[name].outcomes
        cells = [o[kind] for kind in kinds]
        lines.append(f"| {name} | {rows[name].files} | {' | '.join(map(str, cells))} | {rows[name].slowest:.2f} |")
    return "\n".join(lines)


def main(count: int, first: int = 0) -> int:
    """Run and print; the exit status is 1 where there are faults."""
    results = []
    with tempfile.TemporaryDirectory() as folder:
        for format, found in outcomes(range(first, first + count), Path(folder)):
            results.append((format, found))
            if found["outcome"] in FAULTS:
                print(f"{found['number']} {format} {found['reader']}: {found['outcome']} {found['text']}", flush=True)
    print(tabulate(results))
    return int(any(found["outcome"] in FAULTS for _, found in results))


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
