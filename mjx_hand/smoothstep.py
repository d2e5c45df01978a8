"""`smoothstep`: from 0 to 1 without a kink at either end."""

import numpy as np
from jaxtyping import Float


def smoothstep(share: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """3 x^2 - 2 x^3 of the share within 0 and 1; level at both."""
    x = np.clip(share, 0.0, 1.0)
    return x * x * (3 - 2 * x)
