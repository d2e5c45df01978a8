"""The exact projection of a rotation onto one hinge: docs/projection.md, section 1."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.projection.products import dot, trace, turn
from mjx_hand.rotations import vee


def project_one_dof(
    rotation: Float[Array | np.ndarray, "*#b 3 3"], axis: Float[Array | np.ndarray, "*#b 3"]
) -> Float[Array, "*b"]:
    """The angle θ (rad, in (-π, π]) that minimises ‖R - R_a(θ)‖_F.

    θ = atan2(2 a·vee(R), tr R - a·Ra): the twist of R about a. The paper's formula (arXiv 2512.07359) has tr R - 1
    for the second argument, which is the same only where a is R's own axis.

    A half turn about an axis at right angles to `axis` is equally far from every angle: the answer is then 0.

    Args:
        rotation: rotation matrices.
        axis: unit vectors; broadcast against the batch of `rotation`.
    """
    rotation, axis = jnp.asarray(rotation), jnp.asarray(axis)
    sine = 2 * dot(vee(rotation), axis)
    cosine = trace(rotation) - dot(axis, turn(rotation, axis))
    return direction_angle(sine, cosine)


def direction_angle(sine: Float[Array, "*#b"], cosine: Float[Array, "*#b"]) -> Float[Array, "*b"]:
    """atan2 in (-π, π]; where both arguments vanish to rounding, the angle is 0 and so is its gradient."""
    vanishes = sine**2 + cosine**2 < (8 * jnp.finfo(sine.dtype).eps) ** 2
    # atan2 sees (0, 1) there, so that its gradient's division by zero cannot reach the caller as NaN.
    angle = jnp.arctan2(jnp.where(vanishes, 0.0, sine), jnp.where(vanishes, 1.0, cosine))
    return jnp.where(angle <= -jnp.pi, angle + 2 * jnp.pi, angle)  # atan2(-0, -1) is -π
