"""What tyro says of a wrong command line, in one line instead of a box of several."""

import contextlib
import functools
import io
import sys
from collections.abc import Callable
from typing import Any

from mjx_hand.errors import in_one_line

_TITLES = ("Parsing error", "Required options")
_FRAME = "╭╮╰╯│─ \t"


def parsed(parse: Callable[[], Any]) -> Any:
    """What `parse` returns.

    Raises:
        SystemExit: as `parse` ends the process, after `--help` (0) or, with one line, for a wrong command line (2).
    """
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            return parse()
    except SystemExit as end:
        text = said.getvalue()
        if end.code == 2:
            lines = [line.strip(_FRAME) for line in text.splitlines()]
            text = f"mjx-hand: {in_one_line('; '.join(line for line in lines if line and line not in _TITLES))}\n"
        print(text, end="", file=sys.stderr)
        raise


def later(function: Callable[..., Any]) -> Callable[..., Callable[[], Any]]:
    """The function, but all that a call does is to remember its arguments: what comes back makes it."""

    @functools.wraps(function)
    def remembered(*args: Any, **options: Any) -> Callable[[], Any]:
        return functools.partial(function, *args, **options)

    return remembered
