"""The one exception that means "the input is at fault, and here is how to fix it"."""

_LONGEST = 990  # letters of a message; what a file holds may be of any length
_HEAD = 700  # of them from its beginning: the end says how to fix it


class InputError(ValueError):
    """Raised for input that cannot be used.

    The message is one line: what was given, what is valid, and the fix. Commands print it and exit
    with status 2; library callers can catch it as a `ValueError`. What it quotes may come from a file:
    line breaks and control characters are escaped, and of a long text its middle is left out.
    """

    def __init__(self, message: object = ""):
        super().__init__(in_one_line(message))


def in_one_line(said: object) -> str:
    """A text as a terminal shows it in one line: without its middle where it is long, control characters escaped."""
    text = str(said)
    if len(text) > _LONGEST:
        text = f"{text[:_HEAD]} … {text[_HEAD - _LONGEST :]}"
    return "".join(c if c.isprintable() else _escaped(c) for c in text)


def reason_of(error: BaseException) -> str:
    """What a library's exception says, in one line; its type where it says nothing."""
    lines = [line.strip() for line in str(error)[: 2 * _LONGEST].splitlines() if line.strip()]
    return lines[0] if lines else type(error).__name__


def _escaped(character: str) -> str:
    return " " if character in "\n\r\t" else character.encode("unicode_escape", "surrogatepass").decode()
