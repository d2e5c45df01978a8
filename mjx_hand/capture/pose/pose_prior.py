"""What is known of a hand's pose before any marker is seen: fingers bend, and hardly turn otherwise."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.capture.pose.joint_ranges import JointRanges, joint_frames, joint_ranges
from mjx_hand.hand.joints import FINGERS, NUM_BALL_JOINTS
from mjx_hand.hand.model import HandModel
from mjx_hand.pytree import pytree

# Degrees, a joint of a finger, knuckle outwards: mean flexion, then the standard deviations of flexion, abduction
# and rotation about the bone. Flexion is loose, its range is the joint's own. The other two are the off-axis rotation
# of real recordings (MCP up to 16, PIP 8, DIP 3) taken as two standard deviations; one marker a joint barely sees them.
FINGER = ((25.0, 40.0, 12.0, 8.0), (30.0, 40.0, 4.0, 5.0), (20.0, 30.0, 2.0, 2.0))
THUMB = ((10.0, 25.0, 20.0, 8.0), (15.0, 25.0, 6.0, 6.0), (15.0, 30.0, 3.0, 3.0))
# A finger's two outer joints bend together, pulled by the same tendons: the DIP joint two thirds of the PIP joint
# (Rijpkema and Girard 1991, https://doi.org/10.1145/122718.122754). In grasps, where contact bends the tip, it is a
# third to all of it, hence the wide deviation: it takes a fifth off the errors of hidden tips, a tighter one adds.
DIP_FOR_PIP = 2 / 3
DIP_DEVIATION = 20.0  # degrees


@pytree
class PosePrior:
    """A normal distribution of the 15 joints' rotation vectors (rad, hand axes), and the ranges that they stay in.

    Attributes:
        mean: its mean.
        precision: its inverse covariance, finger by finger.
        ranges: the joints' ranges of motion.
    """

    mean: Float[Array, "15 3"]
    precision: Float[Array, "5 9 9"]
    ranges: JointRanges


def pose_prior(hand: HandModel) -> PosePrior:
    """The prior for this hand, along the anatomical axes of its mean shape."""
    frames = joint_frames(hand)
    mean = np.zeros((NUM_BALL_JOINTS, 3))
    precision = np.zeros((len(FINGERS), 9, 9))
    for f, finger in enumerate(FINGERS):
        for k, (flexed, *sigma) in enumerate(np.deg2rad(THUMB if finger == "thumb" else FINGER)):
            axes = frames[3 * f + k]
            mean[3 * f + k] = flexed * axes[0]
            own = slice(3 * k, 3 * k + 3)
            precision[f, own, own] += axes.T @ np.diag(1 / np.square(sigma)) @ axes
        if finger != "thumb":
            # The means of FINGER are in the same proportion, so that this term is zero there and moves none of them.
            together = np.concatenate([np.zeros(3), -DIP_FOR_PIP * frames[3 * f + 1, 0], frames[3 * f + 2, 0]])
            precision[f] += np.outer(together, together) / np.deg2rad(DIP_DEVIATION) ** 2
    return PosePrior(
        mean=jnp.asarray(mean, jnp.float32), precision=jnp.asarray(precision, jnp.float32), ranges=joint_ranges(hand)
    )


def habitual_pose(prior: PosePrior, vectors: Float[np.ndarray, "k 15 3"]) -> Float[np.ndarray, "15 3"]:
    """The prior's mean with each joint bent as it is on average in `vectors` (rad).

    A joint that is hidden most likely does what this person's mostly does. Off the flexion axis a few frames say less
    than the prior does.
    """
    mean, flexion = (np.asarray(a, np.float64) for a in (prior.mean, prior.ranges.axes[:, 0]))
    more = np.einsum("ja,ja->j", flexion, vectors.mean(axis=0) - mean)
    return (mean + more[:, None] * flexion).astype(np.float32)


def joint_precision(precision: Float[np.ndarray, "5 9 9"]) -> Float[np.ndarray, "15 3 3"]:
    """The part of a prior's precision that speaks of each joint alone."""
    blocks = precision.reshape(5, 3, 3, 3, 3)
    return np.einsum("fjajc->fjac", blocks).reshape(NUM_BALL_JOINTS, 3, 3)
