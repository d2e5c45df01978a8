"""A rigid hand with a person's own joint centres."""

import numpy as np
from jaxtyping import Array

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_LINKS, PARENTS, TIP_LINKS
from mjx_hand.pytree import replace
from mjx_hand.rigid.axes import AXES
from mjx_hand.rigid.rigid_hand import RigidHand


def with_link_offsets(
    rigid: RigidHand,
    link_offset: np.ndarray | Array,
    axes: str = "anatomical",
    tip_offset: np.ndarray | Array | None = None,
) -> RigidHand:
    """`rigid` with these joint centres and the hinge axes that follow from them; for kinematics.

    Finger tips that are not given move out or in by as much as the last recorded bone of their finger is longer or
    shorter. Masses, meshes and collision shapes stay as they are: they belong to the hand's shape, which joint centres
    alone do not give.

    Args:
        rigid: the hand to take all else from.
        link_offset: (16, 3), each joint's centre relative to its parent's (m), in hand-frame directions at rest;
            row 0 is zero.
        axes: how the hinge axes are found, a name in `axes.AXES`.
        tip_offset: (5, 3), the finger tips relative to the last joints' centres (m), in hand-frame directions at rest.

    Raises:
        InputError: wrong shape, not finite, a bone of no length, or an unknown axis rule.
    """
    offset = np.asarray(link_offset, dtype=float)
    if offset.shape != (NUM_LINKS, 3) or not np.isfinite(offset).all():
        raise InputError(f"link_offset has shape {offset.shape}; give {NUM_LINKS} x 3 finite numbers (m)")
    if axes not in AXES:
        raise InputError(f"axes is {axes!r}; valid: {', '.join(AXES)}")
    length = np.linalg.norm(offset, axis=1)
    if (length[1:] < 1e-3).any():
        link = int(np.argmin(length[1:])) + 1
        raise InputError(f"link_offset[{link}] is {length[link] * 1e3:.2g} mm long; a bone needs at least 1 mm")
    centres = np.zeros((NUM_LINKS, 3))
    centres[0] = rigid.wrist_position
    for link, parent in enumerate(PARENTS[1:], start=1):
        centres[link] = centres[parent] + offset[link]
    if tip_offset is None:
        tips = list(TIP_LINKS)
        scale = length[tips] / np.linalg.norm(np.asarray(rigid.link_offset)[tips], axis=1)
        tip_offset = np.asarray(rigid.tip_offset) * scale[:, None]
    tip_offset = np.asarray(tip_offset, dtype=float)
    if tip_offset.shape != (len(TIP_LINKS), 3) or not np.isfinite(tip_offset).all():
        raise InputError(f"tip_offset has shape {tip_offset.shape}; give {len(TIP_LINKS)} x 3 finite numbers (m)")
    return replace(
        rigid,
        link_offset=offset,
        hinge_axis=AXES[axes](centres, rigid.side),
        rest_rotation=None,
        tip_offset=tip_offset,
    )
