"""Where the wrist is in each frame, from the markers on the palm, before fingers are known."""

import numpy as np
from jaxtyping import Bool, Float

Array = np.ndarray


def rigid_fit(
    model: Float[Array, "m 3"], observed: Float[Array, "t m 3"], weight: Float[Array, "t m"]
) -> tuple[Float[Array, "t 3 3"], Float[Array, "t 3"], Bool[Array, "t"]]:
    """Rotation and translation that best take `model` to `observed`, frame by frame (Kabsch 1976).

    Returns:
        world-from-model rotations, translations (m), and whether the frame's weighted markers determine them (three
        or more, not on a line).
    """
    total = np.maximum(weight.sum(axis=1), 1e-12)
    mean_model = np.einsum("tm,mc->tc", weight, model) / total[:, None]
    mean_observed = np.einsum("tm,tmc->tc", weight, observed) / total[:, None]
    a = model[None] - mean_model[:, None]
    b = observed - mean_observed[:, None]
    u, size, vt = np.linalg.svd(np.einsum("tm,tmi,tmj->tij", weight, b, a))
    u[..., 2] *= np.linalg.det(u @ vt)[:, None]  # a rotation, not a reflection
    rotation = u @ vt
    translation = mean_observed - np.einsum("tij,tj->ti", rotation, mean_model)
    # The middle singular value is the spread across the line that markers may lie on: at least (5 mm)^2 a marker.
    determined = ((weight > 0).sum(axis=1) >= 3) & (size[:, 1] / total > 2.5e-5)
    return rotation, translation, determined
