"""Messages in the command line's words: options (`--side right`) where the library names arguments (`side='right'`)."""

import re

_OPTIONS = ("side", "sequence", "mano", "fps", "unit", "units", "markers", "layout")
_ARGUMENT = re.compile(rf"(?<![-\w/.])({'|'.join(_OPTIONS)})=('[^']*'|\"[^\"]*\"|[\w.…-]*\b|)")


def as_options(message: str) -> str:
    """A message with options where it names arguments."""
    return _ARGUMENT.sub(lambda found: f"--{found[1]} {found[2].strip(chr(39) + chr(34))}".strip(), message)
