"""Recorded motions onto the 20 hinges of rigid hands, whole sequences at once, and how far off that is."""

from collections.abc import Sequence
from functools import partial

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGES
from mjx_hand.hand.model import HandModel
from mjx_hand.motion import JointMotion, Motion, check_motion
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.motion.plausibility.finding import judged
from mjx_hand.motion.plausibility.pose import angle_findings
from mjx_hand.pytree import pytree, replace
from mjx_hand.retarget.frames import angles_of, errors_of, hand_table, in_chunks
from mjx_hand.retarget.options import RetargetOptions
from mjx_hand.retarget.smoothing import penalty, smooth, unwrap
from mjx_hand.rigid.bone_lengths import with_link_offsets
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand

_SHORTEST = 256  # frames; filters over time see lengths padded to powers of two, so that few are compiled


@pytree
class RetargetErrors:
    """What the 20 hinges could not follow, frame by frame; radians and metres.

    Attributes:
        rotation: geodesic angle between each of the 15 recorded rotations and the hinges' rotation.
        joint_position: distance of each joint centre, wrist-relative, in the order of `hand.joints.LINKS`.
        tip_position: distance of each finger tip, wrist-relative, in the order of `hand.joints.FINGERS`.
        valid: False in the recording's gaps, where nothing is known and the errors are zero.
    """

    rotation: Float[np.ndarray, "t 15"]
    joint_position: Float[np.ndarray, "t 16"]
    tip_position: Float[np.ndarray, "t 5"]
    valid: Bool[np.ndarray, "t"]


def rigid_hand_of(motion: Motion, hand: HandModel, axes: str = "anatomical") -> RigidHand:
    """The rigid hand to retarget `motion` to: the subject's own joint centres where recorded, else the shape's.

    Where the recording has joint centres, everything else is the mean shape's: the recording's shape coefficients
    belong to the hand model that it was made with, which need not be this one.

    Raises:
        InputError: the hand is of the other side, or shape or centres are not valid.
    """
    if hand.side != motion.side:
        raise InputError(f"{motion.source or 'motion'}: a {motion.side} hand; load_hand(side={motion.side!r}) fits it")
    if motion.link_offset is None:
        return build_rigid_hand(hand, motion.shape, axes)
    return with_link_offsets(build_rigid_hand(hand, axes=axes), motion.link_offset, axes, motion.tip_offset)


def retarget_sequence(
    motion: Motion,
    rigid: RigidHand,
    method: str = "exact",
    *,
    carry: bool = False,
    limits: bool = False,
    refine: str = "none",
    smooth: float | None = None,
) -> JointMotion:
    """Bring every frame onto the hinges (one compiled call), and interpolate angles and wrist across gaps.

    Angles have no jumps of whole turns. See `RetargetOptions` for what can be chosen.

    Args:
        motion: the recording; see `rigid_hand_of` for the hand to give with it.
        rigid: the hand whose hinges to use.
        method, carry, limits, refine, smooth: as in `RetargetOptions`.

    Raises:
        InputError: the motion is not well formed, or an option is not valid.
    """
    options = RetargetOptions(method=method, carry=carry, limits=limits, refine=refine, smooth=smooth)
    return retarget_many([motion], [rigid], options)[0]


def retarget_many(motions: Sequence[Motion], hands: Sequence[RigidHand], options: RetargetOptions) -> list[JointMotion]:
    """`retarget_sequence` of several recordings of any lengths, each with its own hand, in one compiled call a chunk.

    Args:
        motions: the recordings.
        hands: as many; at most `frames.HANDS`.
        options: for all of them.

    Raises:
        InputError: a motion is not well formed, or too slow for the filter.
    """
    for motion in motions:
        check_motion(motion)
        if options.smooth is not None:
            penalty(motion.fps, options.smooth)
    call = partial(
        angles_of,
        hands=hand_table(hands),
        method=options.method,
        carry=options.carry,
        limits=options.limits,
        refine=options.refine,
    )
    (angles,) = in_chunks(call, _end_to_end(motions), _numbers(motions))
    ends = np.cumsum([motion.num_frames for motion in motions])[:-1]
    return [
        _over_time(motion, rigid, part, options)
        for motion, rigid, part in zip(motions, hands, np.split(angles, ends), strict=True)
    ]


def retarget_errors(motion: Motion, joint_motion: JointMotion, rigid: RigidHand) -> RetargetErrors:
    """How far the hinges' hand is from the recorded one, both with `rigid`'s bones and the wrist held.

    Raises:
        InputError: the two have different numbers of frames.
    """
    return errors_of_many([motion], [joint_motion], [rigid])[0]


def errors_of_many(
    motions: Sequence[Motion], joint_motions: Sequence[JointMotion], hands: Sequence[RigidHand]
) -> list[RetargetErrors]:
    """`retarget_errors` of several recordings in one compiled call a chunk.

    Raises:
        InputError: a recording and its joint motion have different numbers of frames.
    """
    for motion, joints in zip(motions, joint_motions, strict=True):
        frames, projected = motion.num_frames, joints.num_frames
        if frames != projected:
            raise InputError(
                f"the motion has {frames} frames and the joint motion {projected}; give the pair that belongs"
            )
    table = hand_table(hands)
    angles = np.concatenate([joints.angles for joints in joint_motions]).astype(np.float32)

    errors = in_chunks(partial(errors_of, hands=table), _end_to_end(motions), angles, _numbers(motions))
    ends = np.cumsum([motion.num_frames for motion in motions])[:-1]
    found = []
    for motion, *parts in zip(motions, *(np.split(error, ends) for error in errors), strict=True):
        rotation, joint, tip = (np.where(motion.valid[:, None], part, 0.0) for part in parts)
        found.append(RetargetErrors(rotation=rotation, joint_position=joint, tip_position=tip, valid=motion.valid))
    return found


def _end_to_end(motions: Sequence[Motion]) -> Float[np.ndarray, "n 15 3 3"]:
    """All rotations in single precision; the identity in gaps, whatever stands there."""
    whole = np.empty((sum(motion.num_frames for motion in motions), 15, 3, 3), np.float32)
    start = 0
    for motion in motions:
        part = whole[start : start + motion.num_frames]
        part[:] = motion.rotations
        part[~motion.valid] = np.eye(3)
        start += motion.num_frames
    return whole


def _numbers(motions: Sequence[Motion]) -> Int[np.ndarray, "n"]:
    """Each frame's recording, counted from 0."""
    return np.repeat(np.arange(len(motions), dtype=np.int32), [motion.num_frames for motion in motions])


def _over_time(
    motion: Motion, rigid: RigidHand, angles: Float[np.ndarray, "t 20"], options: RetargetOptions
) -> JointMotion:
    """What depends on other frames: no jumps of whole turns, the filter, and gaps."""
    valid = motion.valid
    lower, upper = np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper)
    if not options.limits:  # within limits there is no other turn
        padded, seen = _padded(angles, valid)
        angles = np.asarray(unwrap(padded, seen, jnp.asarray((lower + upper) / 2, padded.dtype)))[: len(valid)]
    position = fill_lines(motion.wrist_position, valid)
    quaternion = fill_turns(motion.wrist_quaternion, valid)
    if options.smooth is not None:
        rows = np.concatenate([angles, position, quaternion], axis=1).astype(np.float32)
        filtered = smooth(*_padded(rows, valid), penalty(motion.fps, options.smooth))
        angles, position, quaternion = np.split(np.asarray(filtered)[: len(valid)], [20, 23], axis=1)
        quaternion = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
        position, quaternion = fill_lines(position, valid), fill_turns(quaternion, valid)
        if options.limits or options.refine != "none":
            angles = np.clip(angles, lower, upper)
    return JointMotion(
        fps=motion.fps,
        angles=fill_lines(angles, valid),
        wrist_position=position,
        wrist_quaternion=quaternion,
        valid=valid,
        side=motion.side,
        source=motion.source,
        warnings=motion.warnings,
    )


def plausible_angles(joints: JointMotion, rigid: RigidHand) -> JointMotion:
    """`joints` with a warning where they are far beyond the hand's ranges of motion.

    Raises:
        InputError: they are so far beyond that this is no hand.
    """
    lower, upper = np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper)
    found = angle_findings(joints.angles, lower, upper, joints.valid, HINGES)
    return replace(joints, warnings=judged(joints.source or "motion", found, joints.warnings))


def _padded(
    rows: Float[np.ndarray, "t n"], valid: Bool[np.ndarray, "t"]
) -> tuple[Float[np.ndarray, "p n"], Bool[np.ndarray, "p"]]:
    """Frames up to the next power of two, the added ones not valid."""
    length = max(_SHORTEST, 1 << (len(valid) - 1).bit_length())
    return (
        np.concatenate([rows, np.zeros((length - len(rows), rows.shape[1]), rows.dtype)]),
        np.concatenate([valid, np.zeros(length - len(valid), bool)]),
    )
