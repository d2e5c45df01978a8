"""Progress of long work with an estimate of the time left: a bar on a terminal, a plain line now and then elsewhere."""

import contextlib
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sized
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

T = TypeVar("T")

SECONDS_BETWEEN_LINES = 10.0


def progress(items: Iterable[T], description: str, total: int | None = None) -> Iterator[T]:
    """Pass `items` on, showing how far it is; `total` is needed only where they have no length."""
    if total is None and isinstance(items, Sized):
        total = len(items)
    with counter(total, description) as advance:
        for item in items:
            yield item
            advance(1)


@contextlib.contextmanager
def counter(total: int | None, description: str, done: int = 0) -> Iterator[Callable[[int], None]]:
    """A context in which `advance(n)` says that n more of `total` are done; None where the total is not known.

    `done` of them were done before, at no known pace.
    """
    if sys.stdout.isatty():
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=Console(file=sys.stdout)) as bar:
            task = bar.add_task(description, total=total, completed=done)
            yield lambda count: bar.advance(task, count)
    else:
        lines = _Lines(total, description, done)
        yield lines.advance
        lines.write()


class _Lines:
    """Progress as lines of text, for logs: one after some seconds, one at the end."""

    def __init__(self, total: int | None, description: str, done: int):
        self.total, self.description = total, description
        self.done = done
        self.start = self.written = time.monotonic()
        self.first: tuple[float, int] | None = None

    def advance(self, count: int) -> None:
        self.done += count
        # The first piece of work often holds the compilation: what is left is judged by the pace after it.
        self.first = self.first or (time.monotonic(), self.done)
        if time.monotonic() - self.written >= SECONDS_BETWEEN_LINES:
            self.write()

    def write(self) -> None:
        self.written = time.monotonic()
        took = self.written - self.start
        if self.total is None or self.done >= self.total:
            line = f"{self.description}: {self.done} in {clock(took)}"
        else:
            left = self._left(self.total)
            line = f"{self.description}: {self.done}/{self.total} in {clock(took)}"
            line += f", about {clock(left)} left" if left is not None else ""
        print(line, flush=True)

    def _left(self, total: int) -> float | None:
        """Seconds left at the pace since the first piece; None before a second one is done."""
        if self.first is None or self.done <= self.first[1]:
            return None
        since, done = self.first
        return (self.written - since) / (self.done - done) * (total - self.done)


def clock(seconds: float) -> str:
    """A duration as people write it: 0.8 s, 42 s, 3 min 05 s, 2 h 07 min."""
    if seconds < 10:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


@contextlib.contextmanager
def shares() -> Iterator[Callable[[str, float], None]]:
    """A context in which `report(what, share)` says what is being done and what share of it, 0 to 1, is done.

    Each new `what` starts a bar of its own.
    """
    with contextlib.ExitStack() as stack:
        current: dict[str, Callable[[int], None]] = {}
        done: dict[str, int] = {}

        def report(what: str, share: float) -> None:
            if what not in current:
                stack.close()
                current.clear()
                current[what] = stack.enter_context(counter(100, what))
                done[what] = 0
            percent = min(int(100 * share), 100)
            current[what](max(percent - done[what], 0))
            done[what] = max(percent, done[what])

        yield report
