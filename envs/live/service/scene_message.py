"""What a page is told once: the surfaces whose poses it gets from then on."""

import base64
import json
from typing import Any

import numpy as np
import trimesh

from envs.live.twin.placement import Placement
from envs.live.twin.tabletop import Tabletop
from mjx_hand.hand.joints import LINKS
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.view.browser.hand_scene import OBJECT, SKIN, SUPPORT, object_mesh

_STILL = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]


def scene_message(rigid: RigidHand, table: Tabletop, placement: Placement) -> str:
    """JSON: surfaces as base64: vertices (m) float32, triangles uint32; `moving` in the order of a snapshot's poses.

    Args:
        rigid: the hand.
        table: the object and what holds it up.
        placement: of the source's frame, so that a headset shows the table where its wearer's hand is.
    """
    hand = zip(LINKS, rigid.mesh_vertices, rigid.mesh_faces, strict=True)
    moving = [_surface(name, vertices, faces, SKIN, smooth=True) for name, vertices, faces in hand]
    moving.append(_surface(table.name, *object_mesh(table.object), OBJECT, smooth=table.object.kind != "box"))
    still = []
    for half, centre in zip(table.support, table.support_position, strict=True):
        box: Any = trimesh.creation.box(extents=2 * half)
        surface = _surface("support", np.asarray(box.vertices), np.asarray(box.faces), SUPPORT, smooth=False)
        still.append(surface | {"pose": [*map(float, centre), *_STILL[3:]]})
    world_from_source = np.eye(4)
    world_from_source[:3, :3], world_from_source[:3, 3] = placement.rotation, placement.offset
    told = {"moving": moving, "still": still, "world_from_source": world_from_source.T.ravel().tolist()}
    return json.dumps(told)


def _surface(
    name: str, vertices: np.ndarray, faces: np.ndarray, colour: tuple[int, int, int], smooth: bool
) -> dict[str, Any]:
    return {
        "name": name,
        "vertices": _base64(np.asarray(vertices, np.float32)),
        "faces": _base64(np.asarray(faces, np.uint32)),
        "colour": [c / 255 for c in colour],
        "smooth": smooth,
    }


def _base64(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
