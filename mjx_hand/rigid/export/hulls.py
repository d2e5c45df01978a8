"""Collision shapes of the links: capsules, or convex hulls for engines and tasks that want the true outline."""

import numpy as np
import trimesh
from jaxtyping import Float, Int

from mjx_hand.errors import InputError
from mjx_hand.rigid.rigid_hand import RigidHand

COLLISIONS = ("capsules", "hulls")


def check_collision(collision: str) -> None:
    """Raise unless `collision` is a name of `COLLISIONS`."""
    if collision not in COLLISIONS:
        raise InputError(f"collision is {collision!r}; valid: {', '.join(COLLISIONS)}")


def convex_hulls(rigid: RigidHand) -> list[tuple[Float[np.ndarray, "_ 3"], Int[np.ndarray, "_ 3"]]]:
    """The convex hull of each link's mesh: vertices (m, link frame) and outward triangles.

    The palm's hull fills the hollow of the hand, and a web's reaches over the gap that it spans: capsules follow a
    bent hand more closely.
    """
    hulls = [trimesh.convex.convex_hull(vertices) for vertices in rigid.mesh_vertices]
    return [(np.asarray(hull.vertices, float), np.asarray(hull.faces)) for hull in hulls]


def hull_name(link: str) -> str:
    """What a link's hull is called in files and models."""
    return f"{link}_hull"
