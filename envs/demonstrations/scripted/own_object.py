"""A mesh of the user's in place of the objects of a grasp type."""

import dataclasses
from itertools import permutations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from envs.grasps import GraspType, grasp_names, grasp_type
from mjx_hand.errors import InputError
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.mesh_file import object_from_mesh
from mjx_hand.objects.primitives import half_extents
from mjx_hand.pytree import replace

_MARGIN = 1.25  # beyond a type's own sizes; whether a grasp of such an object holds is then tried in physics


@dataclasses.dataclass(frozen=True)
class OwnObject:
    """A user's object; its friction, and its mass where none was given, are drawn from the grasp type's ranges.

    Attributes:
        path: the mesh file.
        description: the object in convex pieces.
        weighed: whether its mass is given.
    """

    path: str
    description: ObjectDescription
    weighed: bool

    def draw(self, grasp: GraspType, rng: np.random.Generator) -> ObjectDescription:
        """The object of one trial."""
        mass, friction = float(rng.uniform(*grasp.object_mass)), float(rng.uniform(*grasp.object_friction))
        return replace(self.description, mass=float(self.description.mass) if self.weighed else mass, friction=friction)


def own_object(path: str, grasp: GraspType, *, mass: float | None = None, density: float | None = None) -> OwnObject:
    """The object of a mesh file, for a grasp type.

    Args:
        path: the mesh (m); its axes are those of the type's objects.
        grasp: the type.
        mass, density: kg or kg/m³, at most one; without either masses are drawn from the type's range.

    Raises:
        InputError: as `object_from_mesh`, or its size does not suit the type.
    """
    weighed = (mass, density) != (None, None)
    description = object_from_mesh(path, mass=mass if weighed else float(np.mean(grasp.object_mass)), density=density)
    check_size(path, description.size, grasp)
    return OwnObject(path, description, weighed)


def check_size(path: str, size: Float[np.ndarray, "3"], grasp: GraspType) -> None:
    """Refuse an object that is much smaller or larger than those of a type.

    Args:
        path: of its mesh, for the message.
        size: half extents (m).
        grasp: the type.

    Raises:
        InputError: saying which way, and for what the object is suited.
    """
    if _fits(size, grasp):
        return
    low, high = 1e3 * _bounds(grasp)
    taken = " x ".join(f"{a:.3g} to {b:.3g}" for a, b in zip(2 * low, 2 * high, strict=True))
    turned = [way for way in permutations(range(3)) if _fits(np.asarray(size)[list(way)], grasp)]
    others = [name for name in grasp_names() if _fits(size, grasp_type(name))]
    if turned:
        advice = f"turn the mesh so that its axes x, y, z are today's {', '.join('xyz'[k] for k in turned[0])}"
    elif others:
        advice = f"its size suits {', '.join(others)}"
    else:
        advice = "scale it, or give finished demonstrations by data.folder"
    raise InputError(
        f"{path}: {' x '.join(f'{2e3 * s:.3g}' for s in size)} mm along its axes; a {grasp.name} grasp is of "
        f"{taken} mm: {advice}"
    )


def _bounds(grasp: GraspType) -> Float[np.ndarray, "2 3"]:
    low, high = (np.asarray(half_extents(grasp.object_kind, jnp.asarray(size))) for size in grasp.object_size)
    return np.stack([low / _MARGIN, high * _MARGIN])


def _fits(size: Float[np.ndarray, "3"], grasp: GraspType) -> bool:
    low, high = _bounds(grasp)
    return bool(((low <= size) & (size <= high)).all())
