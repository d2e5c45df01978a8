"""A data set's object: its poses, and its mesh where the file is there."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.motion import RecordedObject, recorded_object
from mjx_hand.objects.mesh_file import read_object_mesh

Array = np.ndarray


def object_with_mesh(
    name: str, poses: Float[Array, "t *d"], mesh: Path | None, *, unit: str = "m", seen: Bool[Array, "t"] | None = None
) -> RecordedObject:
    """A data set's object, with its mesh where the file is there; without it, the poses alone.

    Args:
        name: of the object.
        poses, seen: as `recorded_object` takes them.
        mesh: the file, there or not.
        unit: of its numbers.

    Raises:
        InputError: poses or mesh cannot be used.
    """
    surface = read_object_mesh(mesh, unit) if mesh is not None and mesh.is_file() else None
    return recorded_object(name, poses, mesh=surface, seen=seen)
