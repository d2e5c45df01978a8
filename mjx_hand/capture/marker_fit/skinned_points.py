"""A few points of a hand's skin: what markers need, at a hundredth of the whole mesh's cost."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from mjx_hand.hand.model import HandModel
from mjx_hand.hand.skinning import link_transforms
from mjx_hand.pytree import pytree


@pytree
class SkinnedPoints:
    """Points that move with a hand's skin, and the hand's joint centres; metres, hand frame.

    Attributes:
        rest: the points on the mean shape at rest.
        rest_directions: their displacement per unit of each shape coefficient.
        pose_directions: their displacement per entry of (R - I), as `HandModel.posedirs`.
        weights: skinning weights.
        centres: joint centres of the mean shape.
        centre_directions: their displacement per unit of each shape coefficient.
    """

    rest: Float[Array, "p 3"]
    rest_directions: Float[Array, "p 3 s"]
    pose_directions: Float[Array, "p 3 135"]
    weights: Float[Array, "p 16"]
    centres: Float[Array, "16 3"]
    centre_directions: Float[Array, "16 3 s"]


def skinned_points(
    hand: HandModel, vertices: Int[np.ndarray, "p"], offsets: Float[np.ndarray, "p 3"], num_shape: int
) -> SkinnedPoints:
    """The hand's `vertices`, moved by `offsets` (m) at rest, with the first `num_shape` shape coefficients."""
    regressor = np.asarray(hand.joint_regressor, np.float64)
    rest = np.asarray(hand.template, np.float64)[vertices]
    directions = np.asarray(hand.shapedirs)[..., :num_shape]
    arrays = {
        "rest": rest + offsets,
        "rest_directions": directions[vertices],
        "pose_directions": hand.posedirs[vertices],
        "weights": hand.weights[vertices],
        "centres": regressor @ hand.template,
        "centre_directions": np.einsum("jv,vcs->jcs", regressor, directions),
    }
    return SkinnedPoints(**{name: jnp.asarray(array, jnp.float32) for name, array in arrays.items()})


def shape_points(
    points: SkinnedPoints, shape: Float[Array, "*b s"]
) -> tuple[Float[Array, "*b p 3"], Float[Array, "*b 16 3"]]:
    """Rest points and joint centres (m) for shape coefficients."""
    rest = points.rest + jnp.einsum("pcs,...s->...pc", points.rest_directions, shape)
    centres = points.centres + jnp.einsum("jcs,...s->...jc", points.centre_directions, shape)
    return rest, centres


def pose_points(
    points: SkinnedPoints,
    rest: Float[Array, "*b p 3"],
    centres: Float[Array, "*b 16 3"],
    rotations: Float[Array, "*b 15 3 3"],
) -> Float[Array, "*b p 3"]:
    """The posed points relative to the wrist joint (m, axes of the hand frame): `skinning.skin` on a few vertices."""
    rot, pos = link_transforms(rotations, centres)
    return blend_points(points.weights, corrected_rest(points, rest, rotations), centres, rot, pos)


def corrected_rest(
    points: SkinnedPoints, rest: Float[Array, "*b p 3"], rotations: Float[Array, "*b 15 3 3"]
) -> Float[Array, "*b p 3"]:
    """Rest points (m) with the pose's correctives added."""
    feature = (rotations - jnp.eye(3, dtype=rotations.dtype)).reshape(*rotations.shape[:-3], 135)
    return rest + jnp.einsum("pcf,...f->...pc", points.pose_directions, feature)


def blend_points(
    weights: Float[Array, "p 16"],
    rest: Float[Array, "*b p 3"],
    centres: Float[Array, "*b 16 3"],
    link_rotation: Float[Array, "*b 16 3 3"],
    link_position: Float[Array, "*b 16 3"],
) -> Float[Array, "*b p 3"]:
    """Linear blend skinning of rest points (m), relative to the wrist; linear in `rest` and `centres` together."""
    offset = link_position - jnp.einsum("...jab,...jb->...ja", link_rotation, centres) - link_position[..., :1, :]
    blended = jnp.einsum("pj,...jab->...pab", weights, link_rotation)
    return jnp.einsum("...pab,...pb->...pa", blended, rest) + jnp.einsum("pj,...ja->...pa", weights, offset)
