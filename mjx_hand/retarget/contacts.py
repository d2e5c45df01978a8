"""Which finger tips touch an object in a recording, as refinement takes it."""

import numpy as np
from jaxtyping import Float, Int

from mjx_hand.errors import InputError
from mjx_hand.objects.mesh_distance import signed_distance

TOUCHING = 0.005  # m; the tip is a point of the skin, but recordings and meshes are off by millimetres
WEIGHT = 3.0  # of a metre along the surface's normal, against 1 of a metre of the tip's


def contact_normals(
    tips: Float[np.ndarray, "t 5 3"],
    wrist_from_object: Float[np.ndarray, "poses 4 4"],
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
    *,
    touching: float = TOUCHING,
    weight: float = WEIGHT,
) -> tuple[Float[np.ndarray, "t 5 3"], Float[np.ndarray, "t 5"]]:
    """The `contact` of `refine_angles`: for tips that touch the object, its normal there times `weight`; else zero.

    Args:
        tips: recorded finger tips (m, wrist's frame).
        wrist_from_object: the object's pose in the wrist's frame in each frame.
        vertices, faces: the object's closed mesh (m, object's frame).
        touching: a tip touches if its distance is no more than this, on either side of the surface.
        weight: see `WEIGHT`.

    Returns:
        The weighted normals, in the wrist's frame, and the tips' signed distances (m, negative inside).

    Raises:
        InputError: tips, poses or mesh do not fit or are not finite.
    """
    frames, poses = len(tips), len(wrist_from_object)
    if frames != poses:
        raise InputError(f"{frames} frames of tips and {poses} of object poses; give as many of both")
    if not (np.isfinite(tips).all() and np.isfinite(wrist_from_object).all()):
        raise InputError("tips or object poses hold NaN or infinity; leave those frames out")
    rotation, origin = wrist_from_object[:, :3, :3], wrist_from_object[:, :3, 3]
    in_object = np.einsum("tji,tfj->tfi", rotation, tips - origin[:, None])
    distance, direction = signed_distance(in_object.reshape(-1, 3), vertices, faces)
    distance, direction = distance.reshape(tips.shape[:2]), direction.reshape(tips.shape)
    normals = np.einsum("tij,tfj->tfi", rotation, direction)
    return np.where(np.abs(distance)[..., None] <= touching, weight * normals, 0.0), distance
