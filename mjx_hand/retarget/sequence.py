"""A recorded motion onto the 20 hinges of a rigid hand, whole sequence at once, and how far off that is."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.hand.model import HandModel
from mjx_hand.motion import JointMotion, Motion, check_motion
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.projection import project
from mjx_hand.pytree import pytree, replace
from mjx_hand.rigid.bone_lengths import with_link_offsets
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand, chain, joint_rotations, tip_positions
from mjx_hand.rotations import geodesic_angle

_FRAMES = 256  # sequences are padded to a multiple of this, so that most lengths share a compilation


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


def retarget_sequence(motion: Motion, rigid: RigidHand, method: str = "exact") -> JointMotion:
    """Project every frame onto the hinges (one compiled call), and interpolate angles and wrist across gaps.

    Args:
        motion: the recording; see `rigid_hand_of` for the hand to give with it.
        rigid: the hand whose hinges to use.
        method: a name in `projection.METHODS`.

    Raises:
        InputError: the motion is not well formed, or the method is unknown.
    """
    check_motion(motion)
    angles = np.asarray(project(_recorded(motion), rigid, method))
    return JointMotion(
        fps=motion.fps,
        angles=fill_lines(angles, motion.valid),
        wrist_position=fill_lines(motion.wrist_position, motion.valid),
        wrist_quaternion=fill_turns(motion.wrist_quaternion, motion.valid),
        valid=motion.valid,
        side=motion.side,
        source=motion.source,
    )


def retarget_errors(motion: Motion, joint_motion: JointMotion, rigid: RigidHand) -> RetargetErrors:
    """How far the hinges' hand is from the recorded one, both with `rigid`'s bones and the wrist held.

    Raises:
        InputError: the two have different numbers of frames.
    """
    frames, projected = motion.num_frames, joint_motion.num_frames
    if frames != projected:
        raise InputError(f"the motion has {frames} frames and the joint motion {projected}; give the pair that belongs")
    errors = _errors(_recorded(motion), jnp.asarray(joint_motion.angles, jnp.float32), _bare(rigid))
    rotation, joint, tip = (np.where(motion.valid[:, None], np.asarray(e), 0.0) for e in errors)
    return RetargetErrors(rotation=rotation, joint_position=joint, tip_position=tip, valid=motion.valid)


def _recorded(motion: Motion) -> Float[Array, "t 15 3 3"]:
    """The rotations as JAX takes them; the identity in gaps, whatever stands there."""
    return jnp.asarray(np.where(motion.valid[:, None, None, None], motion.rotations, np.eye(3)), jnp.float32)


def _bare(rigid: RigidHand) -> RigidHand:
    """Without meshes and name, so that every hand shares one compilation."""
    return replace(rigid, mesh_vertices=(), mesh_faces=(), name="")


@jax.jit
def _errors(
    rotations: Float[Array, "t 15 3 3"], angles: Float[Array, "t 20"], rigid: RigidHand
) -> tuple[Float[Array, "t 15"], Float[Array, "t 16"], Float[Array, "t 5"]]:
    offset = jnp.asarray(rigid.link_offset)
    reached = joint_rotations(angles, rigid)
    recorded_links, reached_links = chain(rotations, offset), chain(reached, offset)
    joint = jnp.linalg.norm(recorded_links[1] - reached_links[1], axis=-1)
    tip = jnp.linalg.norm(tip_positions(*recorded_links, rigid) - tip_positions(*reached_links, rigid), axis=-1)
    return geodesic_angle(rotations, reached), joint, tip
