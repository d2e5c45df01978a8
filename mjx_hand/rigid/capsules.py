"""A hand's collision capsules: where they are in a posture, which of them a link ends in, how far apart fingers are."""

import itertools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics

_PARALLEL = 1e-14  # m^4, in place of the determinant 0 of parallel segments
_CROSSING = 1e-12  # m^2, where the distance of crossing segments would have no derivative


def capsule_points(
    angles: Float[Array | np.ndarray, "20"], rigid: RigidHand, along: Float[np.ndarray, "n"]
) -> Float[Array, "c n 3"]:
    """Points (m, in the wrist's frame) on the axes of all capsules, at shares `along` of each from end to end."""
    rot, pos = forward_kinematics(angles, rigid)
    links = jnp.array(rigid.capsule_links)
    ends = pos[links][:, None] + jnp.einsum("cij,cej->cei", rot[links], jnp.asarray(rigid.capsule_ends))
    return ends[:, :1] + along[None, :, None] * (ends[:, 1:] - ends[:, :1])


def last_capsule(rigid: RigidHand, link: int) -> int:
    """The number of a link's last capsule."""
    return max(k for k, owner in enumerate(rigid.capsule_links) if owner == link)


def finger_pairs(rigid: RigidHand) -> list[tuple[int, int]]:
    """The numbers of every two capsules that belong to two fingers; the palm's belong to none."""
    finger = [(link - 1) // 3 for link in rigid.capsule_links]  # -1 is the wrist's link, the palm
    capsules = [k for k, owner in enumerate(finger) if owner >= 0]
    return [(a, b) for a, b in itertools.combinations(capsules, 2) if finger[a] != finger[b]]


def axis_distance(one: Float[Array, "*b 2 3"], other: Float[Array, "*b 2 3"]) -> Float[Array, "*b"]:
    """Distance (m) between two segments given by their ends; differentiable, crossing ones included.

    The nearest points of the lines, one's parameter clipped to its segment and the other's solved for again
    (C. Ericson, Real-Time Collision Detection, 2005, section 5.1.9).
    """
    u, v = one[..., 1, :] - one[..., 0, :], other[..., 1, :] - other[..., 0, :]
    apart = one[..., 0, :] - other[..., 0, :]
    uu, vv, uv, ur, vr = (jnp.sum(a * b, axis=-1) for a, b in ((u, u), (v, v), (u, v), (u, apart), (v, apart)))
    s = jnp.clip((uv * vr - ur * vv) / jnp.maximum(uu * vv - uv**2, _PARALLEL), 0.0, 1.0)
    free = (uv * s + vr) / vv
    t = jnp.clip(free, 0.0, 1.0)
    s = jnp.where(free == t, s, jnp.clip((uv * t - ur) / uu, 0.0, 1.0))
    gap = apart + s[..., None] * u - t[..., None] * v
    return jnp.sqrt(jnp.sum(gap * gap, axis=-1) + _CROSSING)
