"""Marker residuals and their derivatives, in closed form.

A marker turns about joint j with every link beyond j that it hangs on, so its derivative is one cross product with the
lever that `skinning weight x (point on that link - joint)` sums to: no automatic differentiation through the chain.
"""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_hand.capture.marker_fit.skinned_points import SkinnedPoints, blend_points, corrected_rest
from mjx_hand.hand.joints import PARENTS
from mjx_hand.hand.skinning import link_transforms
from mjx_hand.pytree import pytree
from mjx_hand.rotations import exp, hat

NUM_POSE = 6 + 45  # wrist rotation, wrist position, 15 rotation vectors


@pytree
class PoseState:
    """The pose of a batch of frames, in JAX arrays on the way through the solver and NumPy arrays outside it.

    Attributes:
        vectors: rotation vectors of the 15 joints, rad.
        wrist_rotation: world from hand axes.
        wrist_position: the wrist joint in the world, m.
    """

    vectors: Float[Any, "b 15 3"]
    wrist_rotation: Float[Any, "b 3 3"]
    wrist_position: Float[Any, "b 3"]


def left_jacobian(v: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """J with d exp(v) = [J dv]x exp(v): how a rotation turns as its rotation vector changes."""
    squared = jnp.sum(v * v, axis=-1)[..., None, None]
    small = squared < 1e-4
    safe = jnp.where(small, 1.0, squared)
    angle = jnp.sqrt(safe)
    first = jnp.where(small, 0.5 - squared / 24, (1 - jnp.cos(angle)) / safe)
    second = jnp.where(small, 1 / 6 - squared / 120, (angle - jnp.sin(angle)) / (safe * angle))
    k = hat(v)
    return jnp.eye(3, dtype=v.dtype) + first * k + second * (k @ k)


def residuals(
    points: SkinnedPoints,
    rest: Float[Array, "b m 3"],
    centres: Float[Array, "b 16 3"],
    state: PoseState,
    observed: Float[Array, "b m 3"],
) -> Float[Array, "b m 3"]:
    """Predicted less observed markers (m), in the axes of the hand, so that nothing depends on the world's frame."""
    rotations = exp(state.vectors)
    rot, pos = link_transforms(rotations, centres)
    predicted = blend_points(points.weights, corrected_rest(points, rest, rotations), centres, rot, pos)
    return predicted - to_hand(state, observed)


def to_hand(state: PoseState, observed: Float[Array, "b m 3"]) -> Float[Array, "b m 3"]:
    """Observed markers relative to the wrist joint, in the axes of the hand."""
    return jnp.einsum("bca,bmc->bma", state.wrist_rotation, observed - state.wrist_position[:, None])


def pose_jacobian(
    points: SkinnedPoints,
    rest: Float[Array, "b m 3"],
    centres: Float[Array, "b 16 3"],
    state: PoseState,
    observed: Float[Array, "b m 3"],
) -> tuple[Float[Array, "b m 3"], Float[Array, "b m 3 51"]]:
    """Residuals and their derivative by the pose.

    The pose's 51 directions: wrist_rotation -> wrist_rotation exp(d), wrist_position moved along the hand's axes,
    and the rotation vectors. Pose correctives are in the residual but left out of the derivative: they move a marker
    by a small part of what the joint does.
    """
    rotations = exp(state.vectors)
    rot, pos = link_transforms(rotations, centres)
    pos = pos - pos[:, :1]
    corrected = corrected_rest(points, rest, rotations)
    # Each marker as a point of each link, times its weight there.
    on_link = jnp.einsum("bjac,bmjc->bmja", rot, corrected[:, :, None] - centres[:, None]) + pos[:, None]
    on_link = points.weights[..., None] * on_link
    observed_in_hand = to_hand(state, observed)
    residual = on_link.sum(axis=2) - observed_in_hand

    beyond = outward_sums(on_link[:, :, 1:], axis=2)
    carried = outward_sums(points.weights[:, 1:], axis=1)
    lever = beyond - carried[..., None] * pos[:, None, 1:]
    parents = jnp.array(PARENTS[1:])
    axes = rot[:, parents] @ left_jacobian(state.vectors)  # (b, 15, 3, 3): column a is where direction a points
    columns = jnp.cross(jnp.swapaxes(axes, -1, -2)[:, None], lever[:, :, :, None, :])  # (b, m, 15, a, c)
    joints = jnp.swapaxes(columns.reshape(*lever.shape[:2], 45, 3), -1, -2)
    wrist_turn = -hat(observed_in_hand)
    wrist_move = jnp.broadcast_to(jnp.eye(3), wrist_turn.shape)
    return residual, jnp.concatenate([wrist_turn, wrist_move, joints], axis=-1)


def outward_sums(values: Array, axis: int) -> Array:
    """For each of the 15 joints along `axis`, the sum over its own link and those beyond it on its finger."""
    shape = values.shape
    fingers = values.reshape(*shape[:axis], 5, 3, *shape[axis + 1 :])
    sums = jnp.flip(jnp.cumsum(jnp.flip(fingers, axis + 1), axis=axis + 1), axis + 1)
    return sums.reshape(shape)


def step_state(state: PoseState, step: Float[Array, "b 51"]) -> PoseState:
    """The pose moved by a step in the directions of `pose_jacobian`."""
    move = jnp.einsum("bac,bc->ba", state.wrist_rotation, step[:, 3:6])
    return PoseState(
        vectors=state.vectors + step[:, 6:].reshape(-1, 15, 3),
        wrist_rotation=state.wrist_rotation @ exp(step[:, :3]),
        wrist_position=state.wrist_position + move,
    )
