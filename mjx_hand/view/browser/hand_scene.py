"""Hands and objects as layers for the viewer."""

import jax.numpy as jnp
import numpy as np
import trimesh
from jaxtyping import Float

from mjx_hand.hand.joints import PARENTS
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.skinning import joint_centres, shaped_template
from mjx_hand.motion import Demonstration, JointMotion, Motion
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.rigid.rigid_hand import RigidHand, chain, forward_kinematics, joint_rotations
from mjx_hand.view.browser.scene import Colour, Mesh, MeshLayer, SkinLayer

SKIN: Colour = (206, 150, 122)
TWIN: Colour = (120, 144, 178)
OBJECT: Colour = (212, 118, 62)
SUPPORT: Colour = (168, 160, 150)
Array = np.ndarray


def transforms(rotation: Float[Array, "*b 3 3"], position: Float[Array, "*b 3"]) -> Float[Array, "*b 4 4"]:
    """Rotations and positions (m) as homogeneous matrices."""
    out = np.zeros((*position.shape[:-1], 4, 4))
    out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = rotation, position, 1.0
    return out


def skin_layer(motion: Motion, hand: HandModel, name: str = "hand", shown: bool = True) -> SkinLayer:
    """The skinned hand of a motion (pose correctives left out).

    Of the motion's shape; where it has the subject's own joint centres, the mean shape's surface spans them.
    """
    shape = np.zeros(hand.num_shape)
    if motion.link_offset is None:
        count = min(len(motion.shape), hand.num_shape)
        shape[:count] = motion.shape[:count]
    rest = shaped_template(hand, jnp.asarray(shape, jnp.float32))
    centres = joint_centres(hand, rest)
    offset = centres - centres[jnp.asarray([0, *PARENTS[1:]])] if motion.link_offset is None else motion.link_offset
    turn, place = chain(jnp.asarray(motion.rotations, jnp.float32), jnp.asarray(offset, jnp.float32))
    return SkinLayer(
        name=name,
        mesh=(np.asarray(rest), np.asarray(hand.faces)),
        weights=np.asarray(hand.weights),
        rest=np.asarray(centres),
        transforms=_in_world(motion, np.asarray(turn), np.asarray(place)),
        colour=SKIN,
        shown=shown,
    )


def skin_vertices(layer: SkinLayer, frame: int) -> Float[Array, "v 3"]:
    """The surface of one frame (m, world), as the browser bends it."""
    moved = layer.transforms[frame]
    place = moved[:, :3, 3] - np.einsum("nij,nj->ni", moved[:, :3, :3], layer.rest)
    turned = np.einsum("nij,vj->vni", moved[:, :3, :3], layer.mesh[0]) + place
    return np.einsum("vn,vni->vi", layer.weights, turned)


def twin_layer(motion: JointMotion, rigid: RigidHand, name: str = "rigid twin", shown: bool = True) -> MeshLayer:
    """The rigid hand of a joint motion, link by link."""
    turn, place = (np.asarray(a) for a in forward_kinematics(jnp.asarray(motion.angles, jnp.float32), rigid))
    return MeshLayer(
        name=name,
        meshes=tuple(zip(rigid.mesh_vertices, rigid.mesh_faces, strict=True)),
        transforms=_in_world(motion, turn, place),
        colour=TWIN,
        shown=shown,
    )


def skinned_motion(motion: JointMotion, shape: Float[Array, "s"], rigid: RigidHand) -> Motion:
    """The joint rotations that hinge angles make, as a motion of a hand of this shape."""
    return Motion(
        fps=motion.fps,
        rotations=np.asarray(joint_rotations(jnp.asarray(motion.angles, jnp.float32), rigid), float),
        wrist_position=motion.wrist_position,
        wrist_quaternion=motion.wrist_quaternion,
        shape=shape,
        valid=motion.valid,
        side=motion.side,
        source=motion.source,
    )


def object_layers(
    demonstration: Demonstration, object_pose: Float[Array, "t 7"] | None = None
) -> tuple[MeshLayer, ...]:
    """The object, as demonstrated or in these poses (m, wxyz), and the boxes that it stands on at first."""
    pose = demonstration.object_pose if object_pose is None else object_pose
    layers = [
        MeshLayer(
            name="object",
            meshes=(object_mesh(demonstration.object),),
            transforms=transforms(quaternion_matrices(pose[:, 3:]), pose[:, :3])[:, None],
            colour=OBJECT,
            edges=demonstration.object.kind in ("box", "mesh"),
        )
    ]
    boxes = [trimesh.creation.box(extents=2 * size) for size in demonstration.support]
    if boxes:
        standing = transforms(np.broadcast_to(np.eye(3), (len(boxes), 3, 3)), demonstration.support_position)
        layers.append(
            MeshLayer(
                name="support",
                meshes=tuple((np.asarray(box.vertices), np.asarray(box.faces)) for box in boxes),
                transforms=np.broadcast_to(standing, (len(pose), *standing.shape)),
                colour=SUPPORT,
                edges=True,
            )
        )
    return tuple(layers)


def object_mesh(description: ObjectDescription) -> Mesh:
    """The surface of an object, in its own frame; of a mesh, its convex pieces."""
    a, b = float(description.size[0]), float(description.size[1])
    mesh = {
        "box": lambda: trimesh.creation.box(extents=2 * description.size),
        "sphere": lambda: trimesh.creation.icosphere(subdivisions=3, radius=a),
        "cylinder": lambda: trimesh.creation.cylinder(radius=a, height=2 * b, sections=48),
        "capsule": lambda: trimesh.creation.capsule(radius=a, height=2 * b, count=[32, 32]),
        "mesh": lambda: trimesh.util.concatenate([trimesh.PointCloud(row).convex_hull for row in description.hulls]),
    }[description.kind]()
    if description.kind == "capsule":
        mesh.apply_translation(-mesh.bounds.mean(axis=0))  # trimesh's begins at its lower ball's centre
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def _in_world(
    motion: Motion | JointMotion, turn: Float[Array, "t n 3 3"], place: Float[Array, "t n 3"]
) -> Float[Array, "t n 4 4"]:
    """World from link, from links relative to the wrist in hand axes."""
    wrist = quaternion_matrices(motion.wrist_quaternion)[:, None]
    position = np.einsum("tnij,tnj->tni", np.broadcast_to(wrist, turn.shape), place)
    return transforms(wrist @ turn, position + motion.wrist_position[:, None])
