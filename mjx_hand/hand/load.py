"""One way to get a hand: the open hand, or a licensed MANO file."""

from pathlib import Path

from mjx_hand.errors import InputError
from mjx_hand.hand.mano_file import load_mano_file
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.open_hand import load_open_hand


def load_hand(source: str | Path | None = None, side: str = "right") -> HandModel:
    """The open hand (`source` None), or the hand in a MANO file (`.pkl`, or `.npz` of the same keys).

    Raises:
        InputError: the side is unknown, or the file cannot be used.
    """
    if side not in ("right", "left"):
        raise InputError(f"side is {side!r}; give 'right' or 'left'")
    return load_open_hand(side) if source is None else load_mano_file(source, side)
