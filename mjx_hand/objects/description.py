"""`ObjectDescription`: a rigid object of simple shape, or of convex pieces."""

import dataclasses

import numpy as np
from jaxtyping import Float

from mjx_hand.pytree import pytree, static

OBJECT_KINDS = ("box", "sphere", "cylinder", "capsule", "mesh")


@pytree
class ObjectDescription:
    """A rigid object of simple shape; metres, kilograms.

    Attributes:
        size: half extents of a box; (radius, 0, 0) of a sphere; (radius, half height, 0) of a cylinder along z;
            (radius, half length without the round ends, 0) of a capsule along z; of a mesh, how far it reaches from
            its frame's origin along each axis.
        mass: uniform density is assumed.
        friction: sliding coefficient.
        hulls: of a mesh, the corners of its convex pieces in the object's frame
            (`mjx_hand.objects.convex_decomposition`); shorter rows repeat a corner. Empty for the other kinds.
        kind: one of `OBJECT_KINDS`.
    """

    size: Float[np.ndarray, "3"]
    mass: float
    friction: float
    hulls: Float[np.ndarray, "h v 3"] = dataclasses.field(default_factory=lambda: np.zeros((0, 0, 3)))
    kind: str = static()


def object_features(description: ObjectDescription) -> Float[np.ndarray, "f"]:
    """What of an object a policy may be told: size (m), mass (kg), friction, and 1 for its kind of `OBJECT_KINDS`."""
    kinds = [float(description.kind == kind) for kind in OBJECT_KINDS]
    return np.array([*description.size, description.mass, description.friction, *kinds], float)
