"""The rigid hands of many recordings, each made once, with all that kinematics needs."""

from functools import lru_cache
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import PARENTS, TIP_LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.skinning import joint_centres, shaped_template
from mjx_hand.motion import Motion
from mjx_hand.projection.functional_axes import fit_functional_axes
from mjx_hand.rigid.axes import AXES
from mjx_hand.rigid.bone_lengths import with_link_offsets
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand

FUNCTIONAL = "functional"  # axes fitted to the recording's own rotations, from the anatomical ones


class KinematicHands:
    """`rigid_hand_of` for many recordings, where joints, tips, hinges and limits are all that matters.

    Masses, meshes and collision shapes, which take some tenths of a second per person, stay the mean hand's;
    a person's hand takes milliseconds, and is kept.

    Args:
        mano: a licensed MANO file, or None for the open hand.
        axes: how the hinge axes are found: a name in `axes.AXES`, or "functional".

    Raises:
        InputError: an unknown name.
    """

    def __init__(self, mano: Path | None = None, axes: str = "anatomical"):
        if axes not in (*AXES, FUNCTIONAL):
            raise InputError(f"axes is {axes!r}; valid: {', '.join((*AXES, FUNCTIONAL))}")
        self._functional = axes == FUNCTIONAL
        self._rule = "anatomical" if self._functional else axes
        self._hand = lru_cache(maxsize=2)(lambda side: load_hand(mano, side))
        self._mean = lru_cache(maxsize=2)(lambda side: build_rigid_hand(self._hand(side), axes=self._rule))
        self._shaped = lru_cache(maxsize=1024)(self._of_shape)

    def of(self, motion: Motion) -> RigidHand:
        """The hand for a recording: the subject's own joint centres where recorded, else the shape's.

        Raises:
            InputError: shape or joint centres are not valid, or too few frames to fit axes to.
        """
        if motion.link_offset is None:
            rigid = self._shaped(motion.side, np.asarray(motion.shape, dtype=float).tobytes())
        else:
            rigid = with_link_offsets(self._mean(motion.side), motion.link_offset, self._rule, motion.tip_offset)
        return fit_functional_axes(rigid, motion.rotations, motion.valid) if self._functional else rigid

    def _of_shape(self, side: str, shape: bytes) -> RigidHand:
        hand, coefficients = self._hand(side), np.frombuffer(shape)
        if len(coefficients) > hand.num_shape:
            raise InputError(f"shape has {len(coefficients)} coefficients; {hand.name} has {hand.num_shape}")
        rest = shaped_template(hand, jnp.asarray(coefficients))
        centres = np.asarray(joint_centres(hand, rest), dtype=float)
        tips = np.asarray(rest, dtype=float)[np.asarray(hand.tip_vertices)] - centres[list(TIP_LINKS)]
        offset = np.concatenate([np.zeros((1, 3)), centres[1:] - centres[list(PARENTS[1:])]])
        return with_link_offsets(self._mean(side), offset, self._rule, tips)
