"""The forces on an object as arrows, for pictures."""

import numpy as np
from jaxtyping import Float, Int

from envs.evaluation.rollout import Rollouts

PER_NEWTON = 0.005  # m: an arrow of 5 cm is 10 N
_LEAST = 0.05  # N, below which no arrow is drawn


def contact_arrows(rollouts: Rollouts, index: int, frames: Int[np.ndarray, "t"]) -> Float[np.ndarray, "t touching 2 3"]:
    """From where to where (m, world) an arrow for each link's force goes, in these frames of rollout `index`.

    Arrows end where the link touches, so that they stand outside of the object; NaN for a link that does not touch.
    """
    force, point = np.split(rollouts.contact[index, frames], 2, axis=-1)
    arrows = np.stack([point - PER_NEWTON * force, point], axis=-2)
    return np.where((np.linalg.norm(force, axis=-1) > _LEAST)[..., None, None], arrows, np.nan)
