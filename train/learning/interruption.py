"""Ctrl-C and a polite kill during a training: remembered, so that it stops between two updates and saves first."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType


@contextlib.contextmanager
def interruptions() -> Iterator[Callable[[], int]]:
    """A context in which SIGINT and SIGTERM do nothing but be told of: `asked()` gives the signal's number, or 0.

    A second Ctrl-C ends the process at once. In any thread but the main one, which alone gets signals, it stays 0.
    """
    caught = 0

    def remember(number: int, frame: FrameType | None) -> None:
        nonlocal caught
        if caught and number == signal.SIGINT:
            raise KeyboardInterrupt
        if not caught:
            print("\nstopping after this update, then saving; again to stop at once", flush=True)
        caught = number

    if threading.current_thread() is not threading.main_thread():
        yield lambda: 0
        return
    before = {number: signal.signal(number, remember) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: caught
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def left_to_others() -> Iterator[None]:
    """A context in which the first Ctrl-C, which all processes of a terminal get, is left to the others."""

    def once(number: int, frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, before)

    before = signal.signal(signal.SIGINT, once)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
