"""A subject's hand at rest, from joints that were recorded together with the pose."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.capture.datasets.subject import Subject, check_shape
from mjx_hand.capture.keypoints.layouts import LINK_KEYPOINTS, TIP_KEYPOINTS
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_LINKS, PARENTS, TIP_LINKS

Array = np.ndarray
# How far (m) half of the frames may put a joint from its median place on its parent. Estimates from video change a
# hand's size from frame to frame by some millimetres; joints of another pose or frame differ by centimetres.
_AGREEMENT = 0.01


def offsets_in_parents(turned: Float[Array, "t 16 3 3"], places: Float[Array, "t 16 3"]) -> Float[Array, "t 16 3"]:
    """Each joint's centre in its parent's frame (m), from all links' rotations and joints; the wrist's is zero."""
    offsets = np.zeros((len(places), NUM_LINKS, 3))
    parents = list(PARENTS[1:])
    offsets[:, 1:] = np.einsum("tlji,tlj->tli", turned[:, parents], places[:, 1:] - places[:, parents])
    return offsets


def subject_with_joints(
    path: Path,
    shape: Float[Array, "s"],
    orientation: Float[Array, "t 3 3"],
    rotations: Float[Array, "t 15 3 3"],
    joints: Float[Array, "t 21 3"],
    valid: Bool[Array, "t"],
) -> Subject:
    """The subject whose joints these are: the resting wrist and the offsets are medians over the frames.

    Args:
        path: of the recording, for the message.
        shape: the subject's shape coefficients.
        orientation: of the wrist in the frame of `joints`.
        rotations: of the 15 joints about the flat hand.
        joints: metres, in the order of `keypoints.layouts.KEYPOINTS`, before any translation: MANO turns a hand about
            its wrist, which therefore stays where it is at rest.
        valid: the frames to use.

    Raises:
        InputError: the joints do not follow from the rotations, or the coefficients are no hand's.
    """
    check_shape(shape)
    places = joints[:, list(LINK_KEYPOINTS)]
    turned = [orientation]
    for link, parent in enumerate(PARENTS[1:]):
        turned.append(turned[parent] @ rotations[:, link])
    offsets = offsets_in_parents(np.stack(turned, axis=1), places)
    offsets[:, 0] = places[:, 0]
    last = np.stack([turned[link] for link in TIP_LINKS], axis=1)
    tips = np.einsum("tfji,tfj->tfi", last, joints[:, list(TIP_KEYPOINTS)] - places[:, list(TIP_LINKS)])

    everything = np.concatenate([offsets, tips], axis=1)[valid]
    middle = np.median(everything, axis=0)
    apart = np.median(np.linalg.norm(everything - middle, axis=-1), axis=0)
    if apart.max() > _AGREEMENT:
        raise InputError(
            f"{path}: the recorded joints do not follow from the pose: a bone changes by {apart.max() * 1e3:.0f} mm; "
            "expected 21 joints (wrist, then thumb to little finger) of the same hand in metres"
        )
    links = middle[:NUM_LINKS].copy()
    links[0] = 0
    return Subject(shape, middle[0], link_offset=links, tip_offset=middle[NUM_LINKS:])
