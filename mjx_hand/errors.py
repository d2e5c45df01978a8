"""The one exception that means "the input is at fault, and here is how to fix it"."""


class InputError(ValueError):
    """Raised for input that cannot be used.

    The message is one line: what was given, what is valid, and the fix. Commands print it and exit
    with status 2; library callers can catch it as a `ValueError`.
    """
