"""The few SO(3) maps that every part shares. Matrices act on column vectors; quaternions are wxyz (MuJoCo's order).

Exponential, logarithm and quaternion conversions are jaxlie's (https://github.com/brentyi/jaxlie), which are
safe to differentiate at the identity.
"""

import jax.numpy as jnp
import jaxlie
from jaxtyping import Array, Float


def hat(v: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """The matrix [v]x with hat(v) @ w = v x w."""
    zero = jnp.zeros_like(v[..., 0])
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    rows = [zero, -z, y, z, zero, -x, -y, x, zero]
    return jnp.stack(rows, axis=-1).reshape(*v.shape[:-1], 3, 3)


def vee(m: Float[Array, "*b 3 3"]) -> Float[Array, "*b 3"]:
    """The vector of the skew part of m: vee(hat(v)) = v."""
    skew = (m - jnp.swapaxes(m, -1, -2)) / 2
    return jnp.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)


def axis_angle_matrix(axis: Float[Array, "*#b 3"], angle: Float[Array, "*#b"]) -> Float[Array, "*b 3 3"]:
    """The rotation by `angle` (rad) about the unit vector `axis` (Rodrigues' formula); the two broadcast.

    As sums of products, without a matrix product, which some accelerators round to fewer digits.
    """
    s, c = jnp.sin(angle)[..., None, None], jnp.cos(angle)[..., None, None]
    outer = axis[..., :, None] * axis[..., None, :]
    return c * jnp.eye(3, dtype=axis.dtype) + s * hat(axis) + (1 - c) * outer


def exp(v: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """Rotation vector (rad) to matrix."""
    return jaxlie.SO3.exp(v).as_matrix()


def log(r: Float[Array, "*b 3 3"]) -> Float[Array, "*b 3"]:
    """Matrix to rotation vector (rad), of length at most pi."""
    return jaxlie.SO3.from_matrix(r).log()


def matrix_to_quaternion(r: Float[Array, "*b 3 3"]) -> Float[Array, "*b 4"]:
    """Matrix to unit quaternion, wxyz."""
    return jaxlie.SO3.from_matrix(r).wxyz


def quaternion_to_matrix(q: Float[Array, "*b 4"]) -> Float[Array, "*b 3 3"]:
    """Quaternion wxyz, normalised here, to matrix."""
    return jaxlie.SO3(q).normalize().as_matrix()


def quaternion_difference(a: Float[Array, "*b 4"], b: Float[Array, "*b 4"]) -> Float[Array, "*b 3"]:
    """Rotation vector (rad, in a's own axes) of the turn that takes orientation a to b; both wxyz."""
    return (jaxlie.SO3(a).inverse() @ jaxlie.SO3(b)).log()


def geodesic_angle(a: Float[Array, "*b 3 3"], b: Float[Array, "*b 3 3"]) -> Float[Array, "*b"]:
    """Angle (rad, 0 to pi) of the rotation that takes a to b.

    From the chord ‖a - b‖_F = 2√2 sin(angle/2), which keeps its accuracy near zero, where the arc
    cosine of the trace loses half the digits.
    """
    squared = jnp.sum((a - b) ** 2, axis=(-2, -1))
    # where() twice: the square root's gradient at zero is infinite, and must not reach the caller as NaN.
    half_chord = jnp.where(squared > 0, jnp.sqrt(jnp.where(squared > 0, squared, 1.0)), 0.0) / (2 * jnp.sqrt(2.0))
    return 2 * jnp.arcsin(jnp.minimum(half_chord, 1.0))
