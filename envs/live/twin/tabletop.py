"""`Tabletop`: the object, and where it stands at first."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.grasps import grasp_names, grasp_type
from envs.grasps.grasp_type import UNTURNED
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.mesh_file import object_from_mesh
from mjx_hand.view.browser.hand_scene import object_mesh


@dataclass(frozen=True)
class Tabletop:
    """What is on the table.

    Attributes:
        object: its description.
        pose: of its frame at first, position (m) and quaternion (wxyz), world.
        support, support_position: half extents and centres (m) of the boxes that hold it up.
        name: for people.
    """

    object: ObjectDescription
    pose: Float[np.ndarray, "7"]
    support: Float[np.ndarray, "b 3"]
    support_position: Float[np.ndarray, "b 3"]
    name: str


def tabletop(what: str, mass: float | None = None) -> Tabletop:
    """The table with the object of a grasp type, of the middle of its sizes, or with that of a mesh file.

    Args:
        what: a grasp type's name, or the path of a mesh in metres, which stands as it is in its file.
        mass: kg; of a mesh 0.1 if None, of a grasp type's object the middle of its masses.

    Raises:
        InputError: neither of the two, or a mesh that cannot be used.
    """
    if what not in grasp_names():
        if not Path(what).suffix:
            raise InputError(
                f"object is {what!r}; valid: {', '.join(grasp_names())}, or the path of a mesh (.stl, .obj)"
            )
        description = object_from_mesh(what, mass=0.1 if mass is None else mass)
        return _standing(description, np.array(UNTURNED), np.zeros((0, 3)), np.zeros((0, 3)), 0.0, Path(what).stem)
    if mass is not None and not mass > 0:
        raise InputError(f"mass is {mass}; give a positive number of kilograms")
    grasp = grasp_type(what)
    description = ObjectDescription(
        size=np.mean(grasp.object_size, axis=0),
        mass=float(np.mean(grasp.object_mass)) if mass is None else mass,
        friction=float(np.mean(grasp.object_friction)),
        kind=grasp.object_kind,
    )
    half, centre = (np.array([getattr(b, k) for b in grasp.support]).reshape(-1, 3) for k in ("half", "centre"))
    return _standing(description, np.array(grasp.object_rotation), half, centre, grasp.rest, what)


def demonstration_table(shown: Demonstration) -> Tabletop:
    """The table of a demonstration, with its object where that is at first."""
    return Tabletop(shown.object, shown.object_pose[0], shown.support, shown.support_position, shown.grasp or "object")


def _standing(
    description: ObjectDescription,
    rotation: Float[np.ndarray, "3 3"],
    support: Float[np.ndarray, "b 3"],
    support_position: Float[np.ndarray, "b 3"],
    rest: float,
    name: str,
) -> Tabletop:
    """With the object's lowest point at the height `rest` (m), above the origin."""
    lowest = (object_mesh(description)[0] @ rotation.T)[:, 2].min()
    quaternion = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    return Tabletop(description, np.array([0.0, 0.0, rest - lowest, *quaternion]), support, support_position, name)
