"""Keypoints onto the rigid human hand: its size from the recording's bones, then angles and wrist."""

import warnings

import numpy as np
from jaxtyping import Array, Float

from mjx_hand.capture.keypoints.layouts import LINK_KEYPOINTS, NUM_KEYPOINTS, TIP_KEYPOINTS
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_LINKS, PARENTS, TIP_LINKS
from mjx_hand.motion import JointMotion
from mjx_hand.pytree import replace
from mjx_hand.rigid.bone_lengths import with_link_offsets
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.robots.human_tree import human_tree
from mjx_hand.robots.solver.kinematic_tree import BASE
from mjx_hand.robots.solver.objectives import Objective
from mjx_hand.robots.solver.retarget_keypoints import check_keypoints, retarget_keypoints

SMOOTHNESS = 1e-5  # of the human hand: enough to choose between equals, too little to be seen beside the keypoints
SHORTEST, LONGEST = 3e-3, 0.3  # m; a bone beyond them is no bone of a hand
SIZES = ("bones", "scale", "keep")


def human_objective(smoothness: float = SMOOTHNESS) -> Objective:
    """All 21 keypoints where they are, with a wrist that moves freely."""
    every, nowhere = tuple(range(NUM_KEYPOINTS)), (BASE,) * NUM_KEYPOINTS
    return Objective(
        smoothness=smoothness,
        kind="vector",
        origins=nowhere,
        tasks=every,
        human_origins=nowhere,
        human_tasks=every,
        free_base=True,
        second_order=False,
    )


def sized_hand(rigid: RigidHand, keypoints: Float[np.ndarray | Array, "t 21 3"], size: str = "bones") -> RigidHand:
    """`rigid` with the size of the person recorded, for kinematics.

    Directions between joint centres stay the hand's; lengths are medians over the frames, which outliers do not move.

    Args:
        rigid: of the same side.
        keypoints: m; NaN where one is missing.
        size: "bones" for every bone's own length, "scale" for one factor, "keep" for `rigid` as it is.

    Raises:
        InputError: unknown `size`, or bones that are no hand's: another unit, or other points.
    """
    if size not in SIZES:
        raise InputError(f"size is {size!r}; valid: {', '.join(SIZES)}")
    if size == "keep":
        return rigid
    points = check_keypoints(keypoints)
    offsets, tips = np.asarray(rigid.link_offset, float), np.asarray(rigid.tip_offset, float)
    starts = [*(LINK_KEYPOINTS[PARENTS[link]] for link in range(1, NUM_LINKS)), *(LINK_KEYPOINTS[k] for k in TIP_LINKS)]
    ends = [*LINK_KEYPOINTS[1:], *TIP_KEYPOINTS]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a bone that was never seen is NaN
        found = np.nanmedian(np.linalg.norm(points[:, ends] - points[:, starts], axis=-1), axis=0)
    seen = np.isfinite(found)
    if not seen.any():
        raise InputError("keypoints: no bone has both its ends in any frame; give frames with neighbouring keypoints")
    if (found[seen] < SHORTEST).any() or (found[seen] > LONGEST).any():
        low, high = 1e3 * found[seen].min(), 1e3 * found[seen].max()
        raise InputError(f"keypoints: bones of {low:.3g} to {high:.3g} mm are no hand's; give metres, in this order")
    model = np.linalg.norm(np.concatenate([offsets[1:], tips]), axis=1)
    common = np.median(found[seen] / model[seen])
    factor = np.where(seen, found / model, common) if size == "bones" else np.full(len(model), common)
    scaled = np.concatenate([np.zeros((1, 3)), offsets[1:] * factor[: NUM_LINKS - 1, None]])
    return replace(with_link_offsets(rigid, scaled), tip_offset=tips * factor[NUM_LINKS - 1 :, None])


def human_motion(
    keypoints: Float[np.ndarray | Array, "t 21 3"],
    fps: float,
    rigid: RigidHand,
    *,
    smoothness: float = SMOOTHNESS,
    source: str = "",
) -> JointMotion:
    """Hinge angles and wrist pose that bring the hand's 21 points as near to the keypoints as they come.

    Args:
        keypoints: m, in any frame that stands still; NaN where one is missing.
        fps: frames per second.
        rigid: the hand, of the person's size; see `sized_hand`.
        smoothness: see `objectives`.
        source: provenance.

    Raises:
        InputError: see `retarget_keypoints`.
    """
    found = retarget_keypoints(keypoints, human_tree(rigid), human_objective(smoothness), fps=fps)
    return JointMotion(
        fps=fps,
        angles=found.dofs,
        wrist_position=found.base_position,
        wrist_quaternion=found.base_quaternion,
        valid=found.valid,
        side=rigid.side,
        source=source,
    )
