"""Ctrl-C as one line, from the first moment of a program of this project.

Importing what a program needs takes seconds, in which nothing of it could catch anything; and an interruption that
falls into a callback of a library's garbage collector is dropped there, so that the program runs on.
"""

import _thread
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

_PROGRAMS = ("mjx_hand", "envs", "train", "tools")
_AGAIN = 0.1  # s until an interruption that was dropped comes once more


def stop_quietly() -> None:
    """Have Ctrl-C end this process with one line, if it is a program of the project; else leave it alone."""
    if not is_program(sys.orig_argv):
        return
    usual, usual_ignored = sys.excepthook, sys.unraisablehook

    def ended(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        # Libraries that call back may have wrapped it in an error of their own.
        if issubclass(kind, KeyboardInterrupt) or "KeyboardInterrupt" in str(error):
            print("\nmjx-hand: stopped", file=sys.stderr)
        else:
            usual(kind, error, trace)

    def ignored(what: Any) -> None:
        if issubclass(what.exc_type, KeyboardInterrupt):
            again = threading.Timer(_AGAIN, _interrupt)
            again.daemon = True
            again.start()
        else:
            usual_ignored(what)

    sys.excepthook, sys.unraisablehook = ended, ignored


def _interrupt() -> None:
    """Send the main thread a signal, which also ends a wait of the system's, as the terminal's own does."""
    main = threading.main_thread().ident
    if main is not None and hasattr(signal, "pthread_kill"):
        signal.pthread_kill(main, signal.SIGINT)
    else:
        _thread.interrupt_main()


def is_program(words: Sequence[str]) -> bool:
    """Whether the words of a command line start a program of the project, as `sys.orig_argv` has them."""
    for word, following in zip(words[1:], [*words[2:], ""], strict=False):
        if not word.startswith("-"):
            return Path(word).stem == "mjx-hand"
        if word.endswith("m") and not word.startswith("--"):  # -m, -um
            return following.partition(".")[0] in _PROGRAMS
    return False
