"""Frames of any number of recordings and people through one compiled call, spread over all devices of this machine.

Frames are independent of each other: those of all recordings are laid end to end, each with the number of its hand,
and go through in chunks of one size, so that every data set shares one compilation.
"""

from collections.abc import Callable, Sequence
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, Float, Int

from mjx_hand.projection import project
from mjx_hand.pytree import replace
from mjx_hand.retarget.refine import recorded_places, refine_angles
from mjx_hand.rigid.rigid_hand import RigidHand, chain, joint_rotations, stack_hands, tip_positions
from mjx_hand.rotations import geodesic_angle

CHUNK = 8192  # frames per call, about; 5 MB of rotations
HANDS = 64  # different hands per call, at most


@partial(jax.jit, static_argnames=("method", "carry", "limits", "refine"))
def angles_of(
    rotations: Float[Array, "n 15 3 3"],
    hand: Int[Array, "n"],
    hands: RigidHand,
    method: str,
    carry: bool,
    limits: bool,
    refine: str,
) -> Float[Array, "n 20"]:
    """Hinge angles (rad) of each frame with its own hand; `hands` as from `stack_hands`."""

    def one(rotations: Array, hand: Array) -> Array:
        rigid = jax.tree.map(lambda rows: rows[hand], hands)
        angles = project(rotations, rigid, method, carry=carry, limits=limits)
        return refine_angles(angles, recorded_places(rotations, rigid), rigid) if refine == "tips" else angles

    return jax.vmap(one)(rotations, hand)


@jax.jit
def errors_of(
    rotations: Float[Array, "n 15 3 3"], angles: Float[Array, "n 20"], hand: Int[Array, "n"], hands: RigidHand
) -> tuple[Float[Array, "n 15"], Float[Array, "n 16"], Float[Array, "n 5"]]:
    """Errors of rotations (rad), joint centres and finger tips (m), the wrist held."""

    def one(rotations: Array, angles: Array, hand: Array) -> tuple[Array, Array, Array]:
        rigid = jax.tree.map(lambda rows: rows[hand], hands)
        offset = jnp.asarray(rigid.link_offset)
        reached = joint_rotations(angles, rigid)
        recorded_links, reached_links = chain(rotations, offset), chain(reached, offset)
        joint = jnp.linalg.norm(recorded_links[1] - reached_links[1], axis=-1)
        tip = jnp.linalg.norm(tip_positions(*recorded_links, rigid) - tip_positions(*reached_links, rigid), axis=-1)
        return geodesic_angle(rotations, reached), joint, tip

    return jax.vmap(one)(rotations, angles, hand)


def hand_table(hands: Sequence[RigidHand]) -> RigidHand:
    """At most `HANDS` hands as one table of that many rows, the first repeated; its shapes left out."""
    if any(hand.rest_rotation is not None for hand in hands):  # all or none, as the table is one array
        flat = np.tile(np.eye(3), (15, 1, 1))
        hands = [hand if hand.rest_rotation is not None else replace(hand, rest_rotation=flat) for hand in hands]
    plain = {"name": "", "side": "right", "capsule_links": (0,)}  # what kinematics does not need, alike for all
    plain |= {"soft_lower": None, "soft_upper": None, "capsule_ends": np.zeros((1, 2, 3)), "capsule_radius": np.ones(1)}
    bare = [replace(hand, **plain) for hand in hands]
    return stack_hands([*bare, *[bare[0]] * (HANDS - len(bare))])


@cache
def _sharding() -> NamedSharding:
    """Frames spread over this process's devices."""
    return NamedSharding(Mesh(np.array(jax.local_devices()), ("frames",)), PartitionSpec("frames"))


def in_chunks(call: Callable[..., Array | tuple[Array, ...]], *frames: np.ndarray) -> tuple[np.ndarray, ...]:
    """`call` on arrays with one row per frame, chunk by chunk; the last one is padded with its last row.

    The next chunk is handed over while one is computed; no more than two are on the devices.
    """
    devices = len(jax.local_devices())
    size = -(-CHUNK // devices) * devices
    found: list[tuple[np.ndarray, ...]] = []
    waiting: tuple[tuple[Array, ...], int] | None = None
    for start in range(0, len(frames[0]), size):
        parts = [array[start : start + size] for array in frames]
        count = len(parts[0])
        if count < size:
            parts = [np.concatenate([part, np.repeat(part[-1:], size - count, axis=0)]) for part in parts]
        made = call(*(jax.device_put(part, _sharding()) for part in parts))
        if waiting is not None:
            found.append(_fetched(*waiting))
        waiting = (made if isinstance(made, tuple) else (made,)), count
    if waiting is not None:
        found.append(_fetched(*waiting))
    return tuple(np.concatenate(arrays) for arrays in zip(*found, strict=True))


def _fetched(arrays: tuple[Array, ...], count: int) -> tuple[np.ndarray, ...]:
    return tuple(np.asarray(array)[:count] for array in arrays)
