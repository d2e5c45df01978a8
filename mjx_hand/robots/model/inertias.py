"""Masses and inertias of a robot's links, mended where the description's are no body's."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import yourdfpy
from jaxtyping import Float

from mjx_hand.robots.model.shapes import Shape

_DENSITY = 1000.0  # kg/m3 of half of a link's bounding box, where no mass is given
_LEAST_MASS = 1e-3  # kg of a link that moves
_LEAST_INERTIA = 1e-9  # kg m2


@dataclass(frozen=True)
class Inertia:
    """Mass (kg), centre (m) and inertia about it (kg m2), in the link's axes; `note` says what was mended."""

    mass: float
    centre: Float[np.ndarray, "3"]
    tensor: Float[np.ndarray, "3 3"]
    note: str = ""


def inertia_of(link: yourdfpy.Link, shapes: Sequence[Shape], moves: bool) -> Inertia | None:
    """A link's inertia; None of one that needs none: it is fixed to another and has none of its own.

    Where the mass is missing it is that of half the volume of the link's bounding box, of water. Where the inertia is
    missing or no body's (its moments A <= B <= C must be positive, and A + B >= C) it is that of the bounding box.
    """
    given = link.inertial
    mass = 0.0 if given is None or given.mass is None else float(given.mass)
    place = np.eye(4) if given is None or given.origin is None else np.asarray(given.origin, float)
    if not np.isfinite(mass) or mass < 0:
        mass = 0.0
    if mass == 0 and not moves:
        return None
    low, high = _bounds(shapes)
    size, notes = high - low, []
    centre = place[:3, 3]
    if mass == 0:
        mass = max(0.5 * _DENSITY * float(np.prod(size)), _LEAST_MASS)
        centre = (low + high) / 2
        notes.append(f"no mass: {1e3 * mass:.2g} g, half of its bounding box in water")
    tensor = np.zeros((3, 3)) if given is None or given.inertia is None else np.asarray(given.inertia, float)
    tensor = place[:3, :3] @ tensor @ place[:3, :3].T
    if not _possible(tensor):
        side = np.maximum(size, 2e-3) ** 2
        tensor = np.diag(np.maximum(mass / 12 * (side.sum() - side), _LEAST_INERTIA))
        notes.append("its inertia is no body's: that of its bounding box")
    return Inertia(mass, centre, tensor, f"{link.name}: {'; '.join(notes)}" if notes else "")


def _possible(tensor: Float[np.ndarray, "3 3"]) -> bool:
    """Whether a tensor (kg m2) is that of a body."""
    if not np.isfinite(tensor).all() or not np.allclose(tensor, tensor.T):
        return False
    least, middle, most = np.linalg.eigvalsh(tensor)
    return bool(least >= _LEAST_INERTIA and least + middle >= most * (1 - 1e-6))


def _bounds(shapes: Sequence[Shape]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    if not shapes:
        return np.full(3, -0.005), np.full(3, 0.005)
    vertices = np.concatenate([shape.vertices for shape in shapes])
    return vertices.min(axis=0), vertices.max(axis=0)
