"""A scene's objects as layers for the viewer."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mjx_hand.motion import RecordedObject
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.motion.scene import NO_SURFACE
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.pytree import replace
from mjx_hand.view.browser.hand_scene import OBJECT, object_mesh, transforms
from mjx_hand.view.browser.scene import Layer, Mesh, MeshLayer, PointLayer

_AXES = 0.03  # m: how long the axes are that stand for an object without a mesh


def object_layer(found: RecordedObject) -> MeshLayer:
    """The object, where it was last and is next seen in its gaps; an axis cross where its surface is not known."""
    position = fill_lines(found.position, found.seen)
    turn = quaternion_matrices(fill_turns(found.quaternion, found.seen))
    return MeshLayer(
        name=f"object {found.name}",
        meshes=(_mesh(found),),
        transforms=transforms(turn, position)[:, None],
        colour=OBJECT,
        edges=found.kind in ("box", "mesh"),
    )


def turned_layers(layers: Sequence[Layer], up: Float[np.ndarray, "3"]) -> list[Layer]:
    """The layers in a world with z up; axes stay as near as they can to where they were."""
    turn = np.eye(4)
    z = np.array([0.0, 0.0, 1.0])
    axis = np.cross(up, z)
    if np.linalg.norm(axis) > 1e-9:
        angle = np.arctan2(np.linalg.norm(axis), up @ z)
        turn[:3, :3] = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
    elif up[2] < 0:
        turn[:3, :3] = np.diag([1.0, -1.0, -1.0])
    return [
        replace(layer, points=layer.points @ turn[:3, :3].T)
        if isinstance(layer, PointLayer)
        else replace(layer, transforms=turn @ layer.transforms)
        for layer in layers
    ]


def _mesh(found: RecordedObject) -> Mesh:
    if found.kind == "mesh":
        return found.vertices, found.faces
    if found.kind == NO_SURFACE:
        cross: Any = trimesh.creation.axis(origin_size=_AXES / 10, axis_length=_AXES)
        return np.asarray(cross.vertices), np.asarray(cross.faces)
    return object_mesh(ObjectDescription(size=found.size, mass=1.0, friction=1.0, kind=found.kind))
