"""The open hand: a MANO-layout hand under CC0, cut from the MakeHuman body (see PROVENANCE.md)."""

from pathlib import Path

from mjx_hand.errors import InputError
from mjx_hand.hand.mirror import mirrored
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.open_hand_asset import load_asset

ASSET = Path(__file__).with_name("open_hand.npz")


def load_open_hand(side: str = "right") -> HandModel:
    """The open hand; the left one is the exact mirror image of the right.

    1649 vertices, 10 shape coefficients of unit variance over the adult population it was made from, no pose
    correctives; its rest is the flat hand.

    Raises:
        InputError: `side` is not "right" or "left".
    """
    if side not in ("right", "left"):
        raise InputError(f"side is {side!r}; give 'right' or 'left'")
    right = load_asset(ASSET)
    return right if side == "right" else mirrored(right)
