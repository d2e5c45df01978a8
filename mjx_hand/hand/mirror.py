"""The other hand of a pair, by reflection in x."""

import numpy as np

from mjx_hand.hand.model import HandModel
from mjx_hand.pytree import replace

# What the reflection does to a rotation matrix's entries (S R S with S = diag(-1, 1, 1)) and to an axis-angle vector.
_MATRIX_SIGNS = np.outer([-1, 1, 1], [-1, 1, 1]).ravel()
_AXIS_SIGNS = np.array([1, -1, -1])


def mirrored(hand: HandModel) -> HandModel:
    """The hand's mirror image in x: the same shape coefficients and mirrored rotations give the mirrored surface."""
    flip = np.array([-1, 1, 1], np.asarray(hand.template).dtype)
    posedirs = np.asarray(hand.posedirs) * flip[:, None] * np.tile(_MATRIX_SIGNS, 15).astype(flip.dtype)
    return replace(
        hand,
        template=np.asarray(hand.template) * flip,
        faces=np.ascontiguousarray(np.asarray(hand.faces)[:, ::-1]),
        shapedirs=np.asarray(hand.shapedirs) * flip[:, None],
        posedirs=posedirs,
        pose_mean=np.asarray(hand.pose_mean) * _AXIS_SIGNS.astype(flip.dtype),
        side="left" if hand.side == "right" else "right",
    )
