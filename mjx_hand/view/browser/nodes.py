"""Layers as nodes of a viser scene (https://viser.studio), and their movement from frame to frame."""

from collections.abc import Callable

import numpy as np
import trimesh
import viser
from scipy.spatial.transform import Rotation

from mjx_hand.view.browser.scene import Layer, MeshLayer, PointLayer, SkinLayer

Show = Callable[[int], None]  # moves a layer's nodes to a frame
Handle = viser.SceneNodeHandle


def quaternions(transforms: np.ndarray) -> np.ndarray:
    """The rotations (..., 4) of transforms (..., 4, 4), wxyz."""
    flat = Rotation.from_matrix(transforms[..., :3, :3].reshape(-1, 3, 3)).as_quat(scalar_first=True)
    return flat.reshape(*transforms.shape[:-2], 4)


def add_layer(server: viser.ViserServer, layer: Layer) -> tuple[Handle, Show]:
    """Draw a layer at its first frame.

    Returns:
        The node that holds all of it, to hide and show, and what moves it.
    """
    root = server.scene.add_frame(f"/{layer.name}", show_axes=False, visible=layer.shown)
    if isinstance(layer, MeshLayer):
        return root, _add_meshes(server, layer)
    if isinstance(layer, SkinLayer):
        return root, _add_skin(server, layer)
    return root, _add_points(server, layer)


def _look(layer: MeshLayer | SkinLayer) -> float | None:
    return None if layer.opacity >= 1 else layer.opacity  # viser draws None without blending


def _add_meshes(server: viser.ViserServer, layer: MeshLayer) -> Show:
    turns = quaternions(layer.transforms)
    bodies = [
        server.scene.add_mesh_simple(
            f"/{layer.name}/{k}",
            np.asarray(vertices, np.float32),
            np.asarray(faces),
            color=layer.colour,
            opacity=_look(layer),
            flat_shading=layer.edges,
            wxyz=turns[0, k],
            position=layer.transforms[0, k, :3, 3],
        )
        for k, (vertices, faces) in enumerate(layer.meshes)
    ]

    def show(frame: int) -> None:
        for k, body in enumerate(bodies):
            body.wxyz, body.position = turns[frame, k], layer.transforms[frame, k, :3, 3]

    return show


def _add_skin(server: viser.ViserServer, layer: SkinLayer) -> Show:
    turns = quaternions(layer.transforms)
    vertices, faces = layer.mesh
    skin = server.scene.add_mesh_skinned(
        f"/{layer.name}/skin",
        np.asarray(vertices, np.float32),
        np.asarray(faces),
        bone_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(layer.rest), 1)),
        bone_positions=np.asarray(layer.rest, np.float32),
        skin_weights=np.asarray(layer.weights, np.float32),
        color=layer.colour,
        opacity=_look(layer),
    )

    def show(frame: int) -> None:
        for k, bone in enumerate(skin.bones):
            bone.wxyz, bone.position = turns[frame, k], layer.transforms[frame, k, :3, 3]

    show(0)
    return show


def _add_points(server: viser.ViserServer, layer: PointLayer) -> Show:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=layer.radius)
    seen = np.asarray(np.isfinite(layer.points).all(axis=-1))
    at = np.where(seen[..., None], layer.points, 0.0).astype(np.float32)
    count = at.shape[1]
    # A ball for each point: batched instances would be fewer messages, but cannot be hidden one by one.
    balls = [
        server.scene.add_mesh_simple(
            f"/{layer.name}/{k}",
            ball.vertices.astype(np.float32),
            ball.faces,
            color=layer.colour,
            position=at[0, k],
            visible=bool(seen[0, k]),
        )
        for k in range(count)
    ]
    ends = np.zeros((0, 2), int) if layer.lines is None else layer.lines
    lines = None
    if len(ends):
        lines = server.scene.add_line_segments(
            f"/{layer.name}/lines", _segments(at[0], seen[0], ends), layer.colour, thickness=layer.radius / 2
        )

    def show(frame: int) -> None:
        for k, node in enumerate(balls):
            if seen[frame, k]:
                node.position = at[frame, k]
            if node.visible != seen[frame, k]:
                node.visible = bool(seen[frame, k])
        if lines is not None:
            lines.points = _segments(at[frame], seen[frame], ends)

    return show


def _segments(at: np.ndarray, seen: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Line ends (k, 2, 3); a line with a missing end has no length."""
    whole = np.asarray(seen[ends].all(axis=1))
    return np.where(whole[:, None, None], at[ends], 0.0).astype(np.float32)
