"""A hand of a MuJoCo model as a layer for the viewer, whatever hand it is."""

import mujoco
import numpy as np
import trimesh
from jaxtyping import Float

from mjx_hand.objects.description import ObjectDescription
from mjx_hand.rigid.export.mjcf import VISUAL_GROUP
from mjx_hand.view.browser.hand_scene import TWIN, object_mesh, transforms
from mjx_hand.view.browser.scene import Mesh, MeshLayer

_KINDS = {
    mujoco.mjtGeom.mjGEOM_BOX: "box",
    mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
    mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
}


def model_layer(
    model: mujoco.MjModel, qpos: Float[np.ndarray, "t q"], name: str, *, edges: bool = False, shown: bool = True
) -> MeshLayer:
    """The hand as its bodies are seen, one surface for each of them.

    Args:
        model: a scene with what pictures need; the hand is the body `wrist` and all that it carries.
        qpos: of the scene.
        name: what the layer's checkbox says.
        edges: whether its faces meet in edges.
        shown: whether it is visible at first.
    """
    surfaces = _surfaces(model)
    data, bodies = mujoco.MjData(model), list(surfaces)
    turn, place = np.empty((len(qpos), len(bodies), 3, 3)), np.empty((len(qpos), len(bodies), 3))
    for frame, row in enumerate(qpos):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        turn[frame], place[frame] = data.xmat[bodies].reshape(-1, 3, 3), data.xpos[bodies]
    return MeshLayer(
        name=name,
        meshes=tuple(surfaces.values()),
        transforms=transforms(turn, place),
        colour=TWIN,
        edges=edges,
        shown=shown,
    )


def _surfaces(model: mujoco.MjModel) -> dict[int, Mesh]:
    """What is seen of each of the hand's bodies, in the body's frame."""
    hand = model.body_rootid == model.body("wrist").id
    pieces: dict[int, list[Mesh]] = {}
    for geom in np.flatnonzero(model.geom_group == VISUAL_GROUP):
        body = int(model.geom_bodyid[geom])
        if hand[body]:
            pieces.setdefault(body, []).append(_surface(model, int(geom)))
    return {body: trimesh.util.append_faces(*zip(*own, strict=True)) for body, own in sorted(pieces.items())}


def _surface(model: mujoco.MjModel, geom: int) -> Mesh:
    """A geom in its body's frame."""
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
        vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float)
        faces = model.mesh_face[face : face + model.mesh_facenum[mesh]]
    else:
        kind, size = _KINDS[mujoco.mjtGeom(model.geom_type[geom])], model.geom_size[geom]
        vertices, faces = object_mesh(ObjectDescription(size=size, mass=1.0, friction=1.0, kind=kind))
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    return vertices @ turn.reshape(3, 3).T + model.geom_pos[geom], faces
