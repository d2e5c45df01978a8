"""How far joints go, as the fit believes it: free inside their ranges of motion, and a stiff spring outside."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.hand.joints import NUM_BALL_JOINTS
from mjx_hand.hand.model import HandModel
from mjx_hand.pytree import pytree
from mjx_hand.rigid.axes import anatomical_axes
from mjx_hand.rigid.limits import anatomical_limits

GIVE = np.deg2rad(1.0)  # standard deviation of how far a joint is beyond its range
UNLIMITED = 10.0  # rad


@pytree
class JointRanges:
    """Ranges of the components of the 15 joints' rotation vectors.

    Attributes:
        axes: of each joint, as rows: flexion, sideways (at an MCP or CMC abduction), and about the bone.
        lower, upper: range of the component along each, rad. Where hinges have no axis there is none.
    """

    axes: Float[Array, "15 3 3"]
    lower: Float[Array, "15 3"]
    upper: Float[Array, "15 3"]


def joint_frames(hand: HandModel) -> Float[np.ndarray, "15 3 3"]:
    """Of each joint, as rows: the anatomical flexion axis, sideways, and about the bone; on the mean shape."""
    axes = anatomical_axes(np.asarray(hand.joint_regressor, np.float64) @ hand.template, hand.side).reshape(5, 4, 3)
    flexion = axes[:, 1:]
    # At right angles to flexion: a thumb's hinges are turned away from its base joint's axes.
    sideways = axes[:, :1] - np.sum(axes[:, :1] * flexion, axis=-1, keepdims=True) * flexion
    sideways /= np.linalg.norm(sideways, axis=-1, keepdims=True)
    return np.stack([flexion, sideways, np.cross(flexion, sideways)], axis=-2).reshape(NUM_BALL_JOINTS, 3, 3)


def joint_ranges(hand: HandModel) -> JointRanges:
    """The ranges of the hinges (`rigid.limits`), along the anatomical axes of the hand's mean shape."""
    bounds = []
    for limit, unlimited in zip(anatomical_limits(), (-UNLIMITED, UNLIMITED), strict=True):
        hinges = limit.reshape(5, 4)
        bound = np.full((5, 3, 3), unlimited)
        bound[:, :, 0] = hinges[:, 1:]
        bound[:, 0, 1] = hinges[:, 0]
        bounds.append(jnp.asarray(bound.reshape(NUM_BALL_JOINTS, 3), jnp.float32))
    return JointRanges(axes=jnp.asarray(joint_frames(hand), jnp.float32), lower=bounds[0], upper=bounds[1])


def beyond(ranges: JointRanges, vectors: Float[Array, "b 15 3"]) -> Float[Array, "b 15 3"]:
    """How far (rad) each component is above (positive) or below (negative) its range."""
    components = jnp.einsum("jka,bja->bjk", ranges.axes, vectors)
    return components - jnp.clip(components, ranges.lower, ranges.upper)
