"""Where a fitted hand would show its markers, seen or not."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.capture.marker_fit.skinned_points import SkinnedPoints, pose_points, shape_points, skinned_points
from mjx_hand.capture.markers.marker_set import MarkerSet, rest_offsets
from mjx_hand.hand.model import HandModel
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.resample import quaternion_matrices

CHUNK = 256  # frames a compiled call: recordings of every length share one compilation


def predicted_markers(
    hand: HandModel, motion: Motion, marker_set: MarkerSet, offsets: Float[np.ndarray, "m 3"]
) -> Float[np.ndarray, "t m 3"]:
    """The markers' centres in every frame (m, the motion's world frame).

    Args:
        hand: the hand that was fitted.
        motion: its motion.
        marker_set: the markers it wears.
        offsets: how far (m, hand axes at rest) each is from where the set puts it, as `FitReport.offsets`.
    """
    points = skinned_points(hand, marker_set.vertices, rest_offsets(marker_set, hand) + offsets, len(motion.shape))
    shape = jnp.asarray(motion.shape, jnp.float32)
    local = []
    for start in range(0, motion.num_frames, CHUNK):
        rotations = np.asarray(motion.rotations[start : start + CHUNK], np.float32)
        padding = np.broadcast_to(np.eye(3, dtype=np.float32), (CHUNK - len(rotations), 15, 3, 3))
        posed = posed_points(points, shape, jnp.concatenate([rotations, padding]))
        local.append(np.asarray(posed, np.float64)[: len(rotations)])
    turn = quaternion_matrices(motion.wrist_quaternion)
    return np.einsum("tab,tmb->tma", turn, np.concatenate(local)) + motion.wrist_position[:, None]


@jax.jit
def posed_points(
    points: SkinnedPoints, shape: Float[Array, "s"], rotations: Float[Array, "b 15 3 3"]
) -> Float[Array, "b p 3"]:
    """Points of one subject relative to the wrist joint (m, hand axes)."""
    rest, centres = shape_points(points, jnp.broadcast_to(shape, (rotations.shape[0], *shape.shape)))
    return pose_points(points, rest, centres, rotations)
