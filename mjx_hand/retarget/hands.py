"""The rigid hands of many recordings, each made once."""

from functools import lru_cache
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import PARENTS, TIP_LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.skinning import joint_centres, shaped_template
from mjx_hand.motion import Motion
from mjx_hand.rigid.bone_lengths import with_link_offsets
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand


class KinematicHands:
    """`rigid_hand_of` for many recordings, where joints, tips, hinges and limits are all that matters.

    Masses, meshes and collision shapes, which take a tenth of a second and more a person to make, stay the mean
    hand's; a person's hand takes about a millisecond, and is kept.

    Args:
        mano: a licensed MANO file, or None for the open hand.
        axes: how the hinge axes are found, a name in `axes.AXES`.
    """

    def __init__(self, mano: Path | None = None, axes: str = "anatomical"):
        self.axes = axes
        self._hand = lru_cache(maxsize=2)(lambda side: load_hand(mano, side))
        self._mean = lru_cache(maxsize=2)(lambda side: build_rigid_hand(self._hand(side), axes=axes))
        self._shaped = lru_cache(maxsize=1024)(self._of_shape)

    def of(self, motion: Motion) -> RigidHand:
        """The hand for a recording.

        Raises:
            InputError: shape or joint centres are not valid.
        """
        if motion.link_offset is None:
            return self._shaped(motion.side, np.asarray(motion.shape, dtype=float).tobytes())
        return with_link_offsets(self._mean(motion.side), motion.link_offset, self.axes, motion.tip_offset)

    def _of_shape(self, side: str, shape: bytes) -> RigidHand:
        hand = self._hand(side)
        coefficients = np.frombuffer(shape)
        if len(coefficients) > hand.num_shape:
            raise InputError(f"{len(coefficients)} shape coefficients; this hand has {hand.num_shape}")
        rest = shaped_template(hand, jnp.asarray(coefficients))
        centres = np.asarray(joint_centres(hand, rest), dtype=float)
        tips = np.asarray(rest, dtype=float)[np.asarray(hand.tip_vertices)] - centres[list(TIP_LINKS)]
        offset = np.concatenate([np.zeros((1, 3)), centres[1:] - centres[list(PARENTS[1:])]])
        return with_link_offsets(self._mean(side), offset, self.axes, tips)
