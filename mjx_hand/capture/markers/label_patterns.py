"""Regular expressions for markers' labels, of a kind that is matched in no time whatever the label.

Python's matcher tries every way to divide a text among repeats: a repeated group takes 2^n steps for n letters, and k
repeats in a row n^k (Cox, Regular Expression Matching Can Be Simple And Fast, 2007). Labels need neither.
"""

import re

from mjx_hand.errors import InputError

LONGEST = 64  # letters of a label that a pattern is tried on; longer ones are not labels that anybody has a pattern for
REPEATS, OPTIONAL = 4, 6  # most of * + {…} and of ? in a pattern

_PIECES = re.compile(r"\\.|\[\^?\]?(?:\\.|[^\]\\])*\]|\(\?P?[=!:<#>a-zA-Z]*|\)[*+{]|[*+{?]\??|.", re.DOTALL)


def check_pattern(where: str, pattern: object) -> str:
    """`pattern`, if it is a regular expression that is quickly matched.

    Raises:
        InputError: it is none, repeats a group, or has too many repeats; `where` says where it stands.
    """
    text = pattern if isinstance(pattern, str) else ""
    try:
        re.compile(text)
    except (re.error, OverflowError, RecursionError):
        text = ""
    if not text:
        raise InputError(f"{where}: labels has {pattern!r}, which is not a regular expression; quote it"[:300])
    pieces = _PIECES.findall(text)
    repeats = sum(piece[0] in "*+{" for piece in pieces)
    optional = sum(piece[0] == "?" for piece in pieces)
    if any(piece[0] == ")" and len(piece) > 1 for piece in pieces):
        raise InputError(f"{where}: labels has {text!r}, which repeats a group; write one without )*, )+ and ){{"[:300])
    if repeats > REPEATS or optional > OPTIONAL:
        raise InputError(
            f"{where}: labels has {text!r}"[:220] + f"; give at most {REPEATS} of * + {{…}} and {OPTIONAL} of ?"
        )
    return text


def matches(pattern: str, label: str) -> bool:
    """Whether a whole label is what a pattern of `check_pattern` describes; case does not count."""
    return len(label) <= LONGEST and re.fullmatch(pattern, label, re.IGNORECASE) is not None
