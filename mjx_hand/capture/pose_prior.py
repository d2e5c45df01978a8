"""What is known of a hand's pose before any marker is seen: fingers bend, and hardly turn otherwise."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.hand.joints import FINGERS, NUM_BALL_JOINTS
from mjx_hand.hand.model import HandModel
from mjx_hand.pytree import pytree
from mjx_hand.rigid.axes import anatomical_axes

# Degrees, a joint of a finger, knuckle outwards: mean flexion, then the standard deviations of flexion, abduction
# and rotation about the bone. Flexion is loose, its range is the joint's own. The other two are the off-axis rotation
# of real recordings (MCP up to 16, PIP 8, DIP 3) taken as two standard deviations; one marker a joint barely sees them.
FINGER = ((25.0, 40.0, 12.0, 8.0), (30.0, 40.0, 4.0, 5.0), (20.0, 30.0, 2.0, 2.0))
THUMB = ((10.0, 25.0, 20.0, 8.0), (15.0, 25.0, 6.0, 6.0), (15.0, 30.0, 3.0, 3.0))


@pytree
class PosePrior:
    """A normal distribution of the 15 joints' rotation vectors (rad, hand axes).

    Attributes:
        mean: its mean.
        precision: its inverse covariance, joint by joint.
    """

    mean: Float[Array, "15 3"]
    precision: Float[Array, "15 3 3"]


def pose_prior(hand: HandModel) -> PosePrior:
    """The prior for this hand, along the anatomical axes of its mean shape."""
    centres = np.asarray(hand.joint_regressor, np.float64) @ hand.template
    axes = anatomical_axes(centres, hand.side).reshape(5, 4, 3)  # abduction, flexion, then two hinges
    mean = np.zeros((NUM_BALL_JOINTS, 3))
    precision = np.zeros((NUM_BALL_JOINTS, 3, 3))
    for f, finger in enumerate(FINGERS):
        abduction = axes[f, 0]
        for k, (flexed, *sigma) in enumerate(np.deg2rad(THUMB if finger == "thumb" else FINGER)):
            flexion = axes[f, k + 1]
            # At right angles to flexion: a thumb's hinges are turned away from its base joint's axes.
            sideways = abduction - (abduction @ flexion) * flexion
            sideways /= np.linalg.norm(sideways)
            frame = np.stack([flexion, sideways, np.cross(flexion, sideways)], axis=1)
            mean[3 * f + k] = flexed * flexion
            precision[3 * f + k] = frame @ np.diag(1 / np.square(sigma)) @ frame.T
    return PosePrior(mean=jnp.asarray(mean, jnp.float32), precision=jnp.asarray(precision, jnp.float32))
