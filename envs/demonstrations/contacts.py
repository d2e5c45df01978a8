"""How good demonstrations without a known truth are: whether the hand touches what it lifts, and does not sink in."""

import dataclasses
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.demonstrations.from_recording.grasp_pose import capsule_gaps, last_phalanges
from envs.demonstrations.load_set import load_part
from envs.demonstrations.quality import LIFT
from envs.demonstrations.twin_hands import twins
from envs.reference import object_in_hand
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.rigid.rigid_hand import RigidHand, on_device

_RISEN = 0.02  # m: the object is in the hand


@dataclasses.dataclass(frozen=True)
class Contacts:
    """Of n demonstrations with mesh objects.

    Attributes:
        seconds: how long each is.
        lift: highest rise of the object (m).
        mass: of the object (kg).
        gap: mean distance of the last phalanges from the surface, on either side, while the object is lifted (m).
        depth: how deep the hand is inside the object at the worst moment (m).
    """

    seconds: Float[np.ndarray, "n"]
    lift: Float[np.ndarray, "n"]
    mass: Float[np.ndarray, "n"]
    gap: Float[np.ndarray, "n"]
    depth: Float[np.ndarray, "n"]


def check_contacts(folder: str | Path, part: str) -> Contacts:
    """Read one part of a set back, and check it.

    Raises:
        InputError: a file is missing or damaged, or a demonstration does not lift its object by `quality.LIFT`.
    """
    demonstrations = load_part(folder, part)
    rows = []
    for k, (d, hand) in enumerate(zip(demonstrations, twins(demonstrations), strict=True)):
        rise = d.object_pose[:, 2] - d.object_pose[0, 2]
        if rise.max() < LIFT:
            raise InputError(
                f"{Path(folder, part)}: demonstration {k} lifts its object by less than {100 * LIFT:.1f} cm; "
                "give a recording of a grasp that lifts"
            )
        gaps = demonstration_gaps(d, hand)
        tips = np.abs(gaps[:, last_phalanges(hand)])[rise > _RISEN]
        rows.append((d.num_frames / d.motion.fps, rise.max(), d.object.mass, tips.mean(), max(-gaps.min(), 0.0)))
    return Contacts(*np.array(rows).T)


def demonstration_gaps(demonstration: Demonstration, hand: RigidHand) -> Float[np.ndarray, "t c"]:
    """Distance (m) of each of the hand's capsules from a mesh object in each frame; negative inside."""
    d = demonstration
    bare = on_device(hand)
    rows = tuple(jnp.asarray(a, jnp.float32) for a in (d.motion.angles, *object_in_hand(d)))
    return np.asarray(_gaps(rows, bare, jnp.asarray(hull_planes(d.object.hulls), jnp.float32)))


@jax.jit
def _gaps(rows: tuple[Array, Array, Array], hand: RigidHand, planes: Array) -> Float[Array, "t c"]:
    return jax.vmap(lambda q, r, p: capsule_gaps(q, r, p, hand, planes))(*rows)
