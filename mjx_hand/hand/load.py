"""One way to get a hand."""

from pathlib import Path

from mjx_hand.errors import InputError
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.open_hand import load_open_hand


def load_hand(source: str | Path | None = None, side: str = "right") -> HandModel:
    """The open hand (`source` None).

    Raises:
        InputError: the side is unknown, or a file is given, which this version cannot read.
    """
    if source is not None:
        raise InputError(f"{source}: MANO files cannot be read yet; leave the source out to use the open hand")
    return load_open_hand(side)
